// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: everything a fragment shader needs, in one include; gnomon_cast.glsl is for the shadow pass.
// needs:       #version 330 core
#ifndef GNOMON_GLSL
#define GNOMON_GLSL

#include "gnomon_block.glsl"
#include "gnomon_pssm.glsl"
#include "gnomon_lookup.glsl"
#include "gnomon_blend.glsl"

#endif
