// export: what a shared library shows. Each public header opens its namespace with GNOMON_EXPORT; a static library hides even that, so
// that a host's own shared library does not show it on.
#pragma once

#if defined(GNOMON_SHARED) && defined(__GNUC__)
#define GNOMON_EXPORT [[gnu::visibility("default")]]
#else
#define GNOMON_EXPORT
#endif
