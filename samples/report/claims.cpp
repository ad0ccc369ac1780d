#include "claims.h"

namespace gnomon::report {

const std::vector<Claim>& claims() {
  static const std::vector<Claim> all{
      {"zhang-table-1",
       "[Zhang 2006] Table 1: what splits cost",
       "One 1024² map against two to four of 512². Frames per second for one map over those for the splits, four scenes, least to most.",
       {{"TSM, 1024²", "1"}, {"PSSM(2; 512²)", "1.16 – 1.43"}, {"PSSM(3; 512²)", "1.34 – 1.69"}, {"PSSM(4; 512²)", "1.42 – 1.84"}},
       "Splits cost less here: culling lets four maps draw about twice the triangles of one, and four of 512² hold no more texels than one "
       "of 1024². The paper's renderer drew more of its scene again for each split, and its shading took less of a frame than a rasteriser "
       "on a processor takes."},
      {"zhang-figure-8e",
       "[Zhang 2006] Fig. 8(e): dueling frusta",
       "Light nearly against the view: one 2048² map, warped or not, against two to four of 1024². The paper shows pictures: aliasing of "
       "the single maps "
       "\"increases sharply\", the splits' does not.",
       {},
       "Holds. Two splits leave a fraction of the wrong pixels of any single map of as many texels or more; warps gain little, because "
       "light along the view leaves nothing to warp."},
      {"lloyd-figure-1",
       "[Lloyd 2006] Fig. 1: warp and four splits against one warped map",
       "800 × 800 pixels. ZP4+W with 2K × 2K texels in all has low error \"with only a 30 % drop in frame rate\"; even 4K × 4K in one "
       "warped map \"still has severe aliasing\".",
       {{"W, 2K × 2K", "1"}, {"ZP4+W, 2K × 2K in all", "1.43"}},
       "Holds for the greatest error: below that of the one warped map with four times the texels. On average, and so in wrong pixels, the "
       "4K map is still ahead at these depth ranges (far/near 50 to 970; the paper's power plant has more). The drop in frame rate is "
       "smaller than the paper's, because each map draws only what it needs."},
      {"lauritzen-frame-time",
       "[Lauritzen 2010] frame times",
       "SDSM's frame over PSSM's: 13.0 over 14.9 ms and 12.3 over 13.9 ms.",
       {{"PSSM", "1"}, {"SDSM", "0.87 – 0.88"}},
       "The error is lower, the frame not faster: these views bound near and far by what is in them, so PSSM's maps already draw about as "
       "few triangles as SDSM's. Where they do not, SDSM draws far fewer (README, sdsm). The analysis, one pass over the depth buffer, is "
       "not in these times and is in the paper's."},
      {"tang-table-1",
       "[Tang 2017] Table 1: passes and time",
       "LSPSM with ζ = 0.25 against eight splits (LiSCSM) and SDSM of eight; N is 4.3 to 6.2 in the letter.",
       {{"8 slices", "1"}, {"LSPSM, ζ = 0.25", "0.53 – 0.77"}, {"SDSM, 8 slices", "0.53 – 1.07"}},
       "The time is about that of eight splits, not half of it: our rows reach the far end of the view, where the letter's four stop "
       "short, so N is nearer 8, and these lights are steeper against the view than its own (README, lspsm)."},
  };
  return all;
}

}  // namespace gnomon::report
