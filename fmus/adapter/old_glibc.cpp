// Lets an FMU that was linked on a new system load on an old one. What libstdc++.a, libgcc_eh.a and libm of the build
// machine would ask of a new glibc is defined here, hidden, with what every glibc since 2.14 has: each block names the
// version that brought the symbol. Names that old programs use too keep their old version in a new glibc, so on a yet
// newer one only new names can be missing here; then tests/contract/test_package.py, which states the version that is
// left, fails with the name. Only for x86-64. (g++ cannot be told to link for an older glibc, and without this file the
// FMUs need 2.35, which RHEL 9 and Ubuntu 20.04 do not have; a compiler that can, zig, would have to come with the
// build.) NOLINTBEGIN(bugprone-reserved-identifier,performance-no-int-to-ptr)
#include <features.h>

#if defined(__GLIBC__) && defined(__x86_64__)

#include <dlfcn.h>
#include <link.h>

#include <cerrno>

// Hidden by -fvisibility and by the version script.
#define HIDDEN extern "C"

// `now` calls what `name` has been since 2.2.5.
#define OLD(type, now, name, parameters, ...)             \
  extern "C" type old_##name parameters;                  \
  __asm__(".symver old_" #name "," #name "@GLIBC_2.2.5"); \
  HIDDEN type now parameters { return old_##name(__VA_ARGS__); }

// The versions before 2.29 differ in how they set errno only.
OLD(double, exp, exp, (double x) noexcept, x)
OLD(double, log, log, (double x) noexcept, x)
OLD(double, log2, log2, (double x) noexcept, x)
OLD(double, pow, pow, (double x, double y) noexcept, x, y)

#if __GLIBC_PREREQ(2, 32)
// "There may be threads": reference counts stay atomic.
extern "C" {
char __libc_single_threaded = 0;
}
#endif

#if __GLIBC_PREREQ(2, 34)
HIDDEN int pthread_once(int* control, void (*routine)()) noexcept(false) {
  enum { untouched, running, done };
  int expected = untouched;
  if (__atomic_compare_exchange_n(control, &expected, running, false, __ATOMIC_ACQUIRE, __ATOMIC_ACQUIRE)) {
    routine();
    __atomic_store_n(control, done, __ATOMIC_RELEASE);
  }
  while (__atomic_load_n(control, __ATOMIC_ACQUIRE) != done) {
  }
  return 0;
}
// Only asked whether it exists, which means: threads are possible.
HIDDEN int __pthread_key_create(unsigned*, void (*)(void*)) noexcept { return ENOSYS; }
#endif

#if __GLIBC_PREREQ(2, 35)
// Where the unwinder finds its tables: those of this library, which no exception leaves.
extern "C" const ElfW(Ehdr) __ehdr_start;  // the linker's
HIDDEN int _dl_find_object(void*, dl_find_object* found) noexcept {
  const char* const base = reinterpret_cast<const char*>(&__ehdr_start);
  const auto* headers = reinterpret_cast<const ElfW(Phdr)*>(base + __ehdr_start.e_phoff);
  for (int i = 0; i < __ehdr_start.e_phnum; ++i) {
    if (headers[i].p_type != PT_GNU_EH_FRAME) continue;
    *found = {};
    found->dlfo_eh_frame = const_cast<char*>(base + headers[i].p_vaddr);
    return 0;
  }
  return -1;
}
#endif

#if __GLIBC_PREREQ(2, 17)
// GCC 13 and later: sizes of the pool for exceptions out of memory, from the environment. The defaults stay.
HIDDEN char* secure_getenv(const char*) noexcept { return nullptr; }
#endif

#if __GLIBC_PREREQ(2, 38)
// C23 reads "0b…" numbers; nothing here does.
OLD(long, __isoc23_strtol, strtol, (const char* s, char** e, int base), s, e, base)
OLD(unsigned long, __isoc23_strtoul, strtoul, (const char* s, char** e, int base), s, e, base)
OLD(long long, __isoc23_strtoll, strtoll, (const char* s, char** e, int base), s, e, base)
OLD(unsigned long long, __isoc23_strtoull, strtoull, (const char* s, char** e, int base), s, e, base)
#endif

#endif
// NOLINTEND(bugprone-reserved-identifier,performance-no-int-to-ptr)
