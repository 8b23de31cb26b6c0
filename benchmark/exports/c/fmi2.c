/* FMI 2.0 for co-simulation around model_step.

   Value references: inputs, outputs, then the parameters start[0], start[1], ..: the state before the first step.
   An output is computed when it is read, from the state and the inputs that are set. A communication step is a whole
   number of samples, over which the inputs stay. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
#include "model.h"

#define STATES (MODEL_STATES + 1) /* an array of C has a length */

typedef struct {
    double start[STATES], s[STATES], u[MODEL_INPUTS];
    fmi2CallbackFunctions tell;
    char name[64];
} Instance;

static fmi2Status fail(Instance *m, const char *why) {
    if (m->tell.logger) m->tell.logger(m->tell.componentEnvironment, m->name, fmi2Error, "error", "%s", why);
    return fmi2Error;
}

static void rest(Instance *m) {
    memcpy(m->start, model_rest, MODEL_STATES * sizeof(double));
    memcpy(m->s, m->start, sizeof m->s);
    memset(m->u, 0, sizeof m->u);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    Instance *m;
    (void)resources; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || strcmp(guid, MODEL_GUID) != 0) return NULL;
    m = calloc(1, sizeof *m);
    if (!m) return NULL;
    if (functions) m->tell = *functions;
    strncpy(m->name, name, sizeof m->name - 1);
    rest(m);
    return m;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2Reset(fmi2Component c) { rest(c); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Instance *m = c;
    memcpy(m->s, m->start, sizeof m->s);
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean limited, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean ends, fmi2Real stop) {
    (void)c; (void)limited; (void)tolerance; (void)start; (void)ends; (void)stop;
    return fmi2OK;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)c; (void)on; (void)n; (void)categories;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Instance *m = c;
    double s[STATES], y[MODEL_OUTPUTS];
    size_t i;
    memcpy(s, m->s, sizeof s);
    model_step(s, m->u, y);
    for (i = 0; i < n; i++) {
        if (vr[i] < MODEL_INPUTS) value[i] = m->u[vr[i]];
        else if (vr[i] < MODEL_INPUTS + MODEL_OUTPUTS) value[i] = y[vr[i] - MODEL_INPUTS];
        else if (vr[i] < MODEL_INPUTS + MODEL_OUTPUTS + MODEL_STATES)
            value[i] = m->start[vr[i] - MODEL_INPUTS - MODEL_OUTPUTS];
        else return fail(m, "there is no such variable");
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Instance *m = c;
    size_t i;
    for (i = 0; i < n; i++) {
        if (vr[i] < MODEL_INPUTS) m->u[vr[i]] = value[i];
        else if (vr[i] >= MODEL_INPUTS + MODEL_OUTPUTS && vr[i] < MODEL_INPUTS + MODEL_OUTPUTS + MODEL_STATES)
            m->start[vr[i] - MODEL_INPUTS - MODEL_OUTPUTS] = value[i];
        else return fail(m, "only inputs and the start can be set");
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean final) {
    Instance *m = c;
    double y[MODEL_OUTPUTS], samples = floor(size / MODEL_DT + 0.5);
    (void)time; (void)final;
    if (samples < 1 || fabs(samples * MODEL_DT - size) > 1e-6 * MODEL_DT)
        return fail(m, "a communication step must be a whole number of samples");
    for (; samples > 0; samples--) model_step(m->s, m->u, y);
    return fmi2OK;
}

/* What there is none of. */
#define NONE(type, name) \
    fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference vr[], size_t n, type value[]) { \
        (void)vr; (void)value; \
        return n ? fail(c, "all variables are real") : fmi2OK; \
    } \
    fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const type value[]) { \
        (void)vr; (void)value; \
        return n ? fail(c, "all variables are real") : fmi2OK; \
    }
NONE(fmi2Integer, Integer)
NONE(fmi2Boolean, Boolean)
NONE(fmi2String, String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *f) { (void)f; return fail(c, "there is no FMU state"); }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate f) { (void)f; return fail(c, "there is no FMU state"); }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *f) { (void)f; return fail(c, "there is no FMU state"); }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate f, size_t *n) {
    (void)f; (void)n;
    return fail(c, "there is no FMU state");
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate f, fmi2Byte b[], size_t n) {
    (void)f; (void)b; (void)n;
    return fail(c, "there is no FMU state");
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *f) {
    (void)b; (void)n; (void)f;
    return fail(c, "there is no FMU state");
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu,
                                        const fmi2ValueReference k[], size_t nk, const fmi2Real d[], fmi2Real e[]) {
    (void)u; (void)nu; (void)k; (void)nk; (void)d; (void)e;
    return fail(c, "there are no derivatives");
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    (void)vr; (void)n; (void)order; (void)value;
    return fail(c, "there are no derivatives");
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr; (void)n; (void)order; (void)value;
    return fail(c, "there are no derivatives");
}
fmi2Status fmi2CancelStep(fmi2Component c) { return fail(c, "a step is done at once"); }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind; (void)value;
    return fail(c, "a step is done at once");
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    (void)kind; (void)value;
    return fail(c, "a step is done at once");
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind; (void)value;
    return fail(c, "a step is done at once");
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    (void)kind; (void)value;
    return fail(c, "a step is done at once");
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind; (void)value;
    return fail(c, "a step is done at once");
}
