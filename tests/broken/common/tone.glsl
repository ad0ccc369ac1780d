// A user's include with a missing semicolon.
#include "curve.glsl"
