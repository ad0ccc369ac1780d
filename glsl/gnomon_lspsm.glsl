// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: which rectangle of the light plane serves a point [Tang 2017], in constant time: the row by one logarithm, corrected by one
//              comparison with where the next row starts, so that it is exact on every boundary; the column by a multiply; then the
//              partition in that cell. Half-open: a border belongs to what begins there.
// use:         int index = gnomonSelectCell(gnomon, world);
//              gnomonSearchCell compares with every start instead: the same answer, for rows of any heights. gnomonSelectCell does so by
//              itself where the rows follow no rule (RowRule::error). -1 where the solution has no rows, or nothing to shadow in the cell.
// world:       world - origin
// cost:        two dot products, a logarithm, five numbers read by index; no loop, no comparison for each partition
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_LSPSM_GLSL
#define GNOMON_LSPSM_GLSL

#include "gnomon_block.glsl"
#include "gnomon_pssm.glsl"

// The row, or the one before it. Starts lie within 0.02 of whole numbers (solver/block.cpp sees to that).
int gnomonImplRowGuess(vec4 rule, float along) {
  float a = rule.y * along + rule.z;
  float row = (rule.w > 0.0 ? log2(max(a, 1.0)) * rule.w : a) - 0.05;
  return int(clamp(row, 0.0, max(rule.x, 0.0)));
}
// next: along, where the row after the guess starts
int gnomonImplRow(vec4 rule, float along, int guess, float next) { return along >= next && float(guess) < rule.x ? guess + 1 : guess; }

int gnomonImplCell(vec4 row, uvec4 cells, float across) {
  int cell = int(row.w + clamp(floor((across - row.x) * row.y), 0.0, row.z));
  int index = int((cells[cell / 4] >> uint(8 * (cell % 4))) & 255u);
  return index < GNOMON_MAX_PARTITIONS ? index : -1;
}

#define GNOMON_IMPL_ALONG(block, world) dot(block.rowAlong, vec4(world, 1.0))
#define GNOMON_IMPL_GUESS(block, along) gnomonImplRowGuess(block.rowRule, along)
#define GNOMON_IMPL_NEXT(block, guess) block.rowStart[min((guess) + 1, 15) / 4][min((guess) + 1, 15) % 4]
#define GNOMON_IMPL_ROW(block, along) gnomonImplRow(block.rowRule, along, GNOMON_IMPL_GUESS(block, along), GNOMON_IMPL_NEXT(block, GNOMON_IMPL_GUESS(block, along)))
#define GNOMON_IMPL_SEARCHED(block, along) max(gnomonImplBegun(block.rowStart, along), 0)
#define GNOMON_IMPL_CELL(block, row, world) gnomonImplCell(block.rows[row], block.rowCells, dot(block.rowAcross, vec4(world, 1.0)))

//   int gnomonSearchCell(GnomonBlock block, vec3 world)
#define gnomonSearchCell(block, world) GNOMON_IMPL_CELL(block, GNOMON_IMPL_SEARCHED(block, GNOMON_IMPL_ALONG(block, world)), world)

//   int gnomonSelectCell(GnomonBlock block, vec3 world)
#define gnomonSelectCell(block, world) (block.rowRule.w < 0.0 ? gnomonSearchCell(block, world) : GNOMON_IMPL_CELL(block, GNOMON_IMPL_ROW(block, GNOMON_IMPL_ALONG(block, world)), world))

#endif
