#include "text.h"

#include <cstdarg>
#include <cstdio>
#include <stdexcept>

namespace gnomon::cli {

std::string line(const char* format, ...) {
  char text[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

void require(Status status) {
  if (status != Status::ok) throw std::runtime_error(std::string(statusField(status)) + ": " + statusRule(status));
}

}  // namespace gnomon::cli
