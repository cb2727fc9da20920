// What a library that is unloaded leaves behind: libstdc++, which is linked statically, keeps 72,704 bytes, in which
// exceptions find room where there is no memory.
#include <cstddef>

#ifdef __GLIBCXX__
namespace __gnu_cxx {
extern void __freeres();  // NOLINT(bugprone-reserved-identifier): its name in libstdc++
}

namespace {
[[gnu::destructor]] void unload() { __gnu_cxx::__freeres(); }
}  // namespace
#endif
