// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: everything a fragment shader needs, in one include; gnomon_cast.glsl is for the shadow pass.
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_GLSL
#define GNOMON_GLSL

#include "gnomon_block.glsl"
#include "gnomon_pssm.glsl"
#include "gnomon_lloyd.glsl"
#include "gnomon_lspsm.glsl"
#include "gnomon_lookup.glsl"
#include "gnomon_blend.glsl"

#endif
