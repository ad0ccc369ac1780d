// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: which rectangle of the light plane serves a point [Tang 2017], in constant time: the row by one logarithm, corrected by one
//              comparison with where the next row starts, so that it is exact on every boundary; the column by a multiply; then the
//              partition in that cell. Half-open: a border belongs to what begins there.
// use:         int index = gnomonSelectCell(gnomon, world);
//              gnomonSearchCell compares with every start instead: the same answer, for rows of any heights. gnomonSelectCell does so by
//              itself where the rows do not grow by one ratio (RowRule::error, rectangles). -1 where the solution has no rows, or nothing to shadow in the cell.
// world:       world - origin
// cost:        two dot products, a logarithm, three reads by index; no loop, no comparison for each partition
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_LSPSM_GLSL
#define GNOMON_LSPSM_GLSL

#include "gnomon_block.glsl"
#include "gnomon_pssm.glsl"

// The row, or the one before it: starts lie within 0.02 of whole numbers (solver/block.cpp sees to that).
int gnomonImplRowGuess(vec4 rule, float along) {
  return int(clamp(log2(max(rule.y * along + rule.z, 1.0)) * rule.w - 0.05, 0.0, rule.x));
}
// next: along, where the row after the guess starts; no point reaches that of a row that is not there.
int gnomonImplRow(int guess, float along, float next) { return min(along >= next ? guess + 1 : guess, 15); }

int gnomonImplCell(vec4 row, uvec4 cells, float across) {
  float first = floor(row.w), last = (row.w - first) * 32.0;
  uint cell = uint(first + clamp(floor((across - row.x) * row.y), 0.0, last));
  int index = int((cells[cell >> 2u] >> (8u * (cell & 3u))) & 255u);
  return index < GNOMON_MAX_PARTITIONS ? index : -1;
}

#define GNOMON_IMPL_ALONG(block, world) dot(block.rowAlong, vec4(world, 1.0))
#define GNOMON_IMPL_GUESS(block, world) gnomonImplRowGuess(block.rowRule, GNOMON_IMPL_ALONG(block, world))
#define GNOMON_IMPL_RULED(block, world) gnomonImplRow(GNOMON_IMPL_GUESS(block, world), GNOMON_IMPL_ALONG(block, world), block.rows[min(GNOMON_IMPL_GUESS(block, world) + 1, 15)].z)
#define GNOMON_IMPL_SEARCHED(block, world) max(gnomonImplBegun(block.rowStart, GNOMON_IMPL_ALONG(block, world)), 0)
#define GNOMON_IMPL_CELL(block, row, world) gnomonImplCell(block.rows[row], block.rowCells, dot(block.rowAcross, vec4(world, 1.0)))

//   int gnomonSearchCell(GnomonBlock block, vec3 world)
#define gnomonSearchCell(block, world) GNOMON_IMPL_CELL(block, GNOMON_IMPL_SEARCHED(block, world), world)

//   int gnomonSelectCell(GnomonBlock block, vec3 world)
#define gnomonSelectCell(block, world) GNOMON_IMPL_CELL(block, (block.rowRule.w < 0.0 ? GNOMON_IMPL_SEARCHED(block, world) : GNOMON_IMPL_RULED(block, world)), world)

#endif
