// A host for one FMU, on Linux or Windows: steps it under a polynomial force, strikes it, saves and restores it, and
// prints what it sees as hexadecimal, so that platforms can be compared to the last bit. On Linux it does so in a
// thread with 128 KiB of stack, as those of musl have, and traps every invalid, infinite or overflowing operation. host
// LIBRARY GUID SCALE FORCE IMPULSE OUTPUT… [START=VALUE…]   (value references; SCALE of force and impulse; iSTART, bSTART
// are an Integer and a Boolean)
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#ifdef _WIN32
#include <windows.h>
static void* open_library(const char* path) { return (void*)LoadLibraryA(path); }
static void* symbol(void* library, const char* name) { return (void*)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
#include <fenv.h>
#include <pthread.h>
static void* open_library(const char* path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void* symbol(void* library, const char* name) { return dlsym(library, name); }
#endif

static void* library;
#define CALL(name, ...)                                         \
  do {                                                          \
    name##TYPE* function = (name##TYPE*)symbol(library, #name); \
    if (!function || function(__VA_ARGS__) != fmi2OK) {         \
      fprintf(stderr, "%s failed\n", #name);                    \
      exit(1);                                                  \
    }                                                           \
  } while (0)

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
  (void)e, (void)n, (void)c;
  fprintf(stderr, "%d %s\n", (int)s, m);
}

static int run(int argc, char** argv) {
  if (argc < 7) return 2;
  library = open_library(argv[1]);
  if (!library) return fprintf(stderr, "cannot load %s\n", argv[1]), 1;
  const fmi2CallbackFunctions callbacks = {logger, NULL, NULL, NULL, NULL};
  fmi2InstantiateTYPE* instantiate = (fmi2InstantiateTYPE*)symbol(library, "fmi2Instantiate");
  fmi2Component c = instantiate("host", fmi2CoSimulation, argv[2], NULL, &callbacks, fmi2False, fmi2False);
  if (!c) return 1;
  CALL(fmi2SetupExperiment, c, fmi2False, 0, 0, fmi2False, 0);
  while (strchr(argv[argc - 1], '=')) {
    const char* const start = argv[--argc];
    const char kind = start[0];
    const fmi2ValueReference r = (unsigned)atoi(start + (kind == 'i' || kind == 'b'));
    const fmi2Real value = atof(strchr(start, '=') + 1);
    const fmi2Integer integer = (int)value;
    if (kind == 'i')
      CALL(fmi2SetInteger, c, &r, 1, &integer);
    else if (kind == 'b')
      CALL(fmi2SetBoolean, c, &r, 1, &integer);
    else
      CALL(fmi2SetReal, c, &r, 1, &value);
  }
  CALL(fmi2EnterInitializationMode, c);
  CALL(fmi2ExitInitializationMode, c);
  const fmi2Real scale = atof(argv[3]);
  const fmi2ValueReference force[2] = {(unsigned)atoi(argv[4]), (unsigned)atoi(argv[4])};
  const fmi2ValueReference impulse = (unsigned)atoi(argv[5]);
  fmi2FMUstate state = NULL;
  const int outputs = argc - 6;
  for (int i = 0; i < 200; ++i) {
    if (i == 100) CALL(fmi2GetFMUstate, c, &state);
    for (int again = 0; again < (i == 100 ? 2 : 1); ++again) {
      if (again) CALL(fmi2SetFMUstate, c, state);
      const fmi2Real value = scale * 0.1 * (i % 7), slopes[2] = {-0.5 * scale, 0.25 * scale};
      const fmi2Real strike = i % 50 == 0 ? 0.01 * scale : 0.0;
      const fmi2Integer orders[2] = {1, 2};
      CALL(fmi2SetReal, c, force, 1, &value);
      CALL(fmi2SetRealInputDerivatives, c, force, 2, orders, slopes);
      CALL(fmi2SetReal, c, &impulse, 1, &strike);
      CALL(fmi2DoStep, c, i * 0.01, 0.01, fmi2False);
      if (i % 20 == 0) {
        for (int j = 0; j < outputs; ++j) {
          const fmi2ValueReference r = (unsigned)atoi(argv[6 + j]);
          fmi2Real y;
          CALL(fmi2GetReal, c, &r, 1, &y);
          printf("%d %s %a %.17g\n", i, argv[6 + j], y, y);
        }
      }
    }
  }
  CALL(fmi2FreeFMUstate, c, &state);
  CALL(fmi2Terminate, c);
  ((fmi2FreeInstanceTYPE*)symbol(library, "fmi2FreeInstance"))(c);
  return 0;
}

#ifdef _WIN32
int main(int argc, char** argv) { return run(argc, argv); }
#else
struct arguments {
  int argc;
  char** argv;
  int result;
};

static void* in_thread(void* given) {
  struct arguments* a = given;
  feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  a->result = run(a->argc, a->argv);
  return NULL;
}

int main(int argc, char** argv) {
  struct arguments a = {argc, argv, 1};
  pthread_attr_t small;
  pthread_t thread;
  pthread_attr_init(&small);
  if (pthread_attr_setstacksize(&small, 128 * 1024) || pthread_create(&thread, &small, in_thread, &a)) return 1;
  pthread_join(thread, NULL);
  return a.result;
}
#endif
