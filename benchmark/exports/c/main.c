/* Reads the state, then the inputs of each sample; prints the outputs. */
#include <stdio.h>
#include "model.h"

int main(void) {
    static double s[MODEL_STATES + 1];
    double u[MODEL_INPUTS], y[MODEL_OUTPUTS];
    int i, got;
    for (i = 0; i < MODEL_STATES; i++)
        if (scanf("%lf", &s[i]) != 1) return 1;
    for (;;) {
        for (got = 0; got < MODEL_INPUTS && scanf("%lf", &u[got]) == 1; got++) {}
        if (got < MODEL_INPUTS) return got ? 1 : 0;
        model_step(s, u, y);
        for (i = 0; i < MODEL_OUTPUTS; i++) printf(i + 1 < MODEL_OUTPUTS ? "%.17g " : "%.17g\n", y[i]);
    }
}
