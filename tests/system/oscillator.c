/* A mass on a spring and damper, m a + c v + k x = sign * F + load, as a co-simulation FMU of FMI 2.0 and 3.0 in plain C.
 * Taylor series of the linear equation: exact to rounding for a force quadratic in time. `lie` makes it lie, or gives it
 * a solver of others: Euler's with internal steps of at most `inner`, or steps of just `inner`, as many as it needs to
 * reach the end of a step.
 * It exports what a run calls and nothing else that the standards ask for. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum { OK, WARNING, DISCARD, ERROR } Status;
enum { FORCE, IMPULSE, X, V, I1, I2, KINETIC, POTENTIAL, DISSIPATED, LOAD_POTENTIAL, MASS, K, C, LOAD, X0, V0, SIGN, LIE, INNER, N };
enum { HONEST, STATE, VELOCITY, INTEGRAL, SLOPES, HANG, CRASH, NAN_OUT, ENERGY, INTEGRAL_2, EARLY, EVENT, END, LATE_CRASH, LATE_ABORT, LATE_EXIT, LATE_HANG, MESSAGE, SHORT, PAST, EXPLICIT, SEMI_IMPLICIT, GRID };
typedef void Logger(void *environment, const char *instance, Status status, const char *category, const char *format, ...);
typedef struct { Logger *logger; void *allocate, *release, *finished, *environment; } Callbacks;
typedef struct { double r[N], slope, bend, stop, ahead; unsigned calls; const Callbacks *callbacks; } Fmu;

#define API __attribute__((visibility("default")))
static void initial(Fmu *f) {
    memset(f, 0, sizeof *f);
    f->r[MASS] = f->r[SIGN] = 1.0;
}
API void *fmi2Instantiate(const char *name, int type, const char *guid, const char *where, const void *callbacks, int v, int l) {
    static int instances;
    if (!strcmp(guid, "unlicensed") || (!strcmp(guid, "once") && instances++)) {
        fputs("reading the licence\nno licence found\n", stderr);
        return NULL;
    }
    Fmu *f = malloc(sizeof *f);
    initial(f);
    f->callbacks = callbacks;
    return f;
}
API void fmi2FreeInstance(void *c) { free(c); }
API Status fmi2SetupExperiment(void *c, int t, double tol, double start, int s, double stop) {
    ((Fmu *)c)->stop = s ? stop : start;
    return OK;
}
static void outputs(Fmu *f) {
    double *r = f->r;
    r[KINETIC] = 0.5 * r[MASS] * r[V] * r[V] * (r[LIE] == ENERGY ? 2.0 : 1.0);
    r[POTENTIAL] = 0.5 * r[K] * r[X] * r[X];
    r[LOAD_POTENTIAL] = -r[LOAD] * r[X];
}
API Status fmi2EnterInitializationMode(void *c) { return OK; }
API Status fmi2ExitInitializationMode(void *c) {
    Fmu *f = c;
    f->r[X] = f->r[X0], f->r[V] = f->r[V0];
    outputs(f);
    return OK;
}
API Status fmi2Reset(void *c) {
    const Callbacks *callbacks = ((Fmu *)c)->callbacks;
    initial(c);
    ((Fmu *)c)->callbacks = callbacks;
    return OK;
}
API Status fmi2GetReal(void *c, const unsigned vr[], size_t n, double value[]) {
    Fmu *f = c;
    for (size_t i = 0; i < n; ++i) {
        value[i] = f->r[vr[i]];
        if (vr[i] == V && f->r[LIE] == VELOCITY) value[i] *= 1.1;
        if (vr[i] == I1 && f->r[LIE] == INTEGRAL) value[i] *= 2.0;
        if (vr[i] == I2 && f->r[LIE] == INTEGRAL_2) value[i] *= 2.0;
        if (vr[i] == X && f->r[LIE] == NAN_OUT && f->calls > 2) value[i] = 0.0 / 0.0;
    }
    return OK;
}
API Status fmi2SetReal(void *c, const unsigned vr[], size_t n, const double value[]) {
    Fmu *f = c;
    for (size_t i = 0; i < n; ++i) f->r[vr[i]] = value[i];
    return OK;
}
API Status fmi2SetRealInputDerivatives(void *c, const unsigned vr[], size_t n, const int order[], const double value[]) {
    Fmu *f = c;
    if (f->r[LIE] == SLOPES) return OK;
    for (size_t i = 0; i < n; ++i) *(order[i] == 1 ? &f->slope : &f->bend) = value[i];
    return OK;
}
API Status fmi2DoStep(void *c, double time, double H, int no_set) {
    Fmu *f = c;
    double *r = f->r, h = H, rate = (r[C] + 1.0) / r[MASS] + r[K] / r[MASS] + 1.0;
    if (r[LIE] == SHORT && H < 2e-4) return DISCARD;
    if (r[LIE] == PAST && time + H > f->stop * (1 + 1e-12)) return ERROR;
    if (r[LIE] == MESSAGE) {
        f->callbacks->logger(f->callbacks->environment, "oscillator", ERROR, "solver", "k = %g of %s", r[K], "the spring");
        return ERROR;
    }
    bool begun = ++f->calls > 2, late = time > 1.49;
    if ((begun && r[LIE] == HANG) || (late && r[LIE] == LATE_HANG)) {
        fputs("hanging\n", stderr);
        for (volatile int i = 1; i;) {}
    }
    if ((begun && r[LIE] == CRASH) || (late && r[LIE] == LATE_CRASH)) *(volatile int *)0 = 0;
    if (late && r[LIE] == LATE_EXIT) exit(7);
    if (late && r[LIE] == LATE_ABORT) fputs("nobody expected this\n", stderr), abort();
    r[V] += r[IMPULSE] / r[MASS];
    r[IMPULSE] = r[I1] = r[I2] = 0.0;
    double at = r[SIGN] * r[FORCE] + r[LOAD], slope = r[SIGN] * f->slope, bend = r[SIGN] * f->bend;
    int parts = 1;
    if (r[LIE] == EXPLICIT || r[LIE] == SEMI_IMPLICIT) {
        int n = fmax(ceil(H / r[INNER] - 1e-9), 1.0);
        for (int i = 0; i < n; ++i) {
            double v = r[V];
            r[V] += H / n * (at - r[C] * v - r[K] * r[X]) / r[MASS];
            r[X] += H / n * (r[LIE] == EXPLICIT ? v : r[V]);
        }
        outputs(f);
        return OK;
    }
    if (r[LIE] == GRID) {
        int n = fmax(ceil((H - f->ahead) / r[INNER] - 1e-9), 0.0);
        h = n * r[INNER];
        f->ahead += h - H;
    }
    while (h * h * rate > 0.25 || h * rate > 0.5) h *= 0.5, parts *= 2;
    for (int i = 0; i < parts; ++i) {
        /* x = sum a_j t^j; (j+2)(j+1) m a_{j+2} = F_j - c (j+1) a_{j+1} - k a_j */
        double a[26] = {r[X], r[V]}, F[24] = {at, slope, bend / 2}, x = 0, v = 0, once = 0, twice = 0, vv = 0;
        for (int j = 0; j < 24; ++j) a[j + 2] = (F[j] - r[C] * (j + 1) * a[j + 1] - r[K] * a[j]) / (r[MASS] * (j + 1) * (j + 2));
        for (int j = 25; j >= 0; --j) {
            x = x * h + a[j], once = once * h + a[j] / (j + 1), twice = twice * h + a[j] / ((j + 1) * (j + 2));
            if (j) v = v * h + j * a[j];
        }
        once *= h, twice *= h * h;
        /* the integral of v^2, from the product of its series */
        for (int j = 40; j >= 0; --j) {
            double s = 0;
            for (int k = j > 24 ? j - 24 : 0; k <= j && k <= 24; ++k) s += (k + 1) * a[k + 1] * (j - k + 1) * a[j - k + 1];
            vv = vv * h + s / (j + 1);
        }
        r[DISSIPATED] += r[C] * vv * h;
        r[I2] += r[I1] * h + twice, r[I1] += once;
        r[X] = x, r[V] = v;
        at += h * (slope + 0.5 * h * bend), slope += h * bend;
    }
    outputs(f);
    return OK;
}
API Status fmi2GetFMUstate(void *c, void **state) {
    if (!*state) *state = malloc(sizeof(Fmu));
    memcpy(*state, c, sizeof(Fmu));
    return OK;
}
API Status fmi2SetFMUstate(void *c, void *state) {
    Fmu *f = c, before = *f;
    memcpy(f, state, sizeof *f);
    if (f->r[LIE] == STATE) f->r[V] = before.r[V]; /* forgets the velocity */
    return OK;
}
API Status fmi2FreeFMUstate(void *c, void **state) { free(*state); *state = NULL; return OK; }
API Status fmi2SerializedFMUstateSize(void *c, void *state, size_t *n) { *n = sizeof(Fmu); return OK; }
API Status fmi2SerializeFMUstate(void *c, void *state, char bytes[], size_t n) { memcpy(bytes, state, n); return OK; }
API Status fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t n, void **state) {
    if (!*state) *state = malloc(sizeof(Fmu));
    memcpy(*state, bytes, n);
    return OK;
}

API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *where, bool v, bool l, bool event_mode,
                                      bool early, const unsigned vr[], size_t n, void *e, void *log, void *update) {
    return event_mode || early ? NULL : fmi2Instantiate(name, 1, token, where, log, v, l);
}
API void fmi3FreeInstance(void *c) { fmi2FreeInstance(c); }
API Status fmi3EnterInitializationMode(void *c, bool t, double tol, double start, bool s, double stop) {
    return fmi2SetupExperiment(c, t, tol, start, s, stop);
}
API Status fmi3ExitInitializationMode(void *c) { return fmi2ExitInitializationMode(c); }
API Status fmi3GetFloat64(void *c, const unsigned vr[], size_t n, double value[], size_t m) {
    return n == m ? fmi2GetReal(c, vr, n, value) : ERROR;
}
API Status fmi3SetFloat64(void *c, const unsigned vr[], size_t n, const double value[], size_t m) {
    return n == m ? fmi2SetReal(c, vr, n, value) : ERROR;
}
API Status fmi3DoStep(void *c, double time, double H, bool no_set, bool *event, bool *end, bool *early, double *last) {
    Fmu *f = c;
    int lie = (int)f->r[LIE];
    *last = lie == EARLY ? time + 0.5 * H : time + H;
    *event = lie == EVENT, *end = lie == END, *early = lie == EARLY;
    return fmi2DoStep(c, time, *last - time, no_set);
}
API Status fmi3GetFMUState(void *c, void **state) { return fmi2GetFMUstate(c, state); }
API Status fmi3SetFMUState(void *c, void *state) { return fmi2SetFMUstate(c, state); }
API Status fmi3FreeFMUState(void *c, void **state) { return fmi2FreeFMUstate(c, state); }
API Status fmi3SerializedFMUStateSize(void *c, void *state, size_t *n) { return fmi2SerializedFMUstateSize(c, state, n); }
API Status fmi3SerializeFMUState(void *c, void *state, unsigned char bytes[], size_t n) {
    return fmi2SerializeFMUstate(c, state, (char *)bytes, n);
}
API Status fmi3DeserializeFMUState(void *c, const unsigned char bytes[], size_t n, void **state) {
    return fmi2DeSerializeFMUstate(c, (const char *)bytes, n, state);
}
