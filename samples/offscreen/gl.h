// gl: the OpenGL entry points used here. Packaged loaders do not reach an OSMesa context, so the list is ours: types from <GL/glcorearb.h>,
// pointers from the context.
#pragma once

#define GL_GLEXT_PROTOTYPES 1  // for decltype alone: nothing is linked
#include <GL/glcorearb.h>

#include <stdexcept>
#include <string>

#include "context.h"

// clang-format off
#define GNOMON_GL_FUNCTIONS(X)                                                                                                             \
  X(ActiveTexture)                                                                                                                         \
  X(AttachShader)                                                                                                                          \
  X(BindBuffer)                                                                                                                            \
  X(BindBufferBase) X(BindFramebuffer) X(BindTexture) X(BindVertexArray) X(BufferData) X(BufferSubData) X(CheckFramebufferStatus) X(Clear) \
      X(ClearBufferfv) X(ClearBufferuiv) X(ClearDepth) X(ClipControl) X(CompileShader) X(CreateProgram) X(CreateShader) X(DeleteBuffers)   \
          X(DeleteFramebuffers) X(DeleteProgram) X(DeleteShader) X(DeleteTextures) X(DeleteVertexArrays) X(DepthFunc) X(Disable) X(DispatchCompute) \
              X(DrawArrays) X(DrawBuffer) X(DrawBuffers) X(DrawElements) X(DrawElementsInstanced) X(Enable) X(EnableVertexAttribArray)     \
                  X(Finish) X(FramebufferTexture) X(FramebufferTexture2D) X(FramebufferTextureLayer) X(GenBuffers) X(GenFramebuffers)      \
                      X(GenTextures) X(GenVertexArrays) X(MapBufferRange) X(UnmapBuffer) X(MemoryBarrier) X(MultiDrawElementsIndirect) X(GetActiveUniformsiv) X(GetError) X(GetIntegerv) X(GetProgramInfoLog)             \
                          X(GetProgramiv) X(GetShaderInfoLog) X(GetShaderiv) X(GetString) X(GetTexImage) X(GetUniformBlockIndex)           \
                              X(GetUniformIndices) X(GetUniformLocation) X(LinkProgram) X(PixelStorei) X(ReadBuffer) X(ReadPixels)         \
                                  X(Scissor) X(ShaderSource) X(TexImage2D) X(TexImage3D) X(TexParameteri) X(Uniform1f) X(Uniform1i)        \
                                      X(Uniform3f) X(UniformBlockBinding) X(UniformMatrix4fv) X(UseProgram) X(VertexAttribDivisor) X(VertexAttribIPointer) X(VertexAttribPointer)         \
                                          X(Viewport)
// clang-format on

namespace gnomon::offscreen::gl {

#define X(f) inline decltype(&::gl##f) f = nullptr;
GNOMON_GL_FUNCTIONS(X)
#undef X

// Loads every entry point from a current context. Throws std::runtime_error naming the first that is missing.
inline void load(const Context& context) {
#define X(f)                                                   \
  f = reinterpret_cast<decltype(f)>(context.getProc("gl" #f)); \
  if (!f) throw std::runtime_error(context.name() + ": gl" #f " is missing");
  GNOMON_GL_FUNCTIONS(X)
#undef X
}

}  // namespace gnomon::offscreen::gl
