/* Reads questions of two numbers (kind, count) and rows of doubles from the standard input, and writes answers. */
#include CHECK_HEADER
#include <stdio.h>
#include <stdlib.h>

#define CAT(a, b) a##b
#define JOIN(a, b) CAT(a, b)
#define OF(part) JOIN(CHECK_NAME, part)
typedef OF(_real) real;

static void take(real *x, int count) {
  int i;
  for (i = 0; i < count; i++) {
    double value = 0.0;
    if (fread(&value, sizeof value, 1, stdin) != 1) exit(2);
    x[i] = (real)value;
  }
}

static void give(const real *x, int count) {
  int i;
  for (i = 0; i < count; i++) {
    const double value = (double)x[i];
    if (fwrite(&value, sizeof value, 1, stdout) != 1) exit(2);
  }
}

int main(void) {
  int32_t question[2], row;
#if CHECK_MEMORY
  static OF(_state) state;
#endif
  while (fread(question, sizeof question[0], 2, stdin) == 2) {
#if CHECK_MEMORY
    OF(_start)(&state);
#endif
    for (row = 0; row < question[1]; row++) {
#if CHECK_NETWORK
      static real x[OF(_INPUTS)], y[OF(_OUTPUTS)], slopes[OF(_OUTPUTS) * OF(_INPUTS)], inside;
      take(x, OF(_INPUTS));
      OF(_jacobian)(x, y, slopes);
      give(slopes, OF(_OUTPUTS) * OF(_INPUTS));
      OF(_evaluate)(x, y);
      give(y, OF(_OUTPUTS));
      inside = (real)OF(_inside)(x);
      give(&inside, 1);
#else
      static real x[3], p[OF(_PARAMETERS) + 1], answer[19], dt, flags;
      static real work[OF(_DEVIATION_WORK)], deviation;
      if (question[0] == 1) take(&dt, 1);
      take(x, 3);
      take(p, OF(_PARAMETERS));
      if (question[0] == 0) {
        flags = (real)OF(_answer)(x, p, answer);
        OF(_deviation)(x, p, work, &deviation);
        give(answer, 19);
        give(&deviation, 1);
        give(&flags, 1);
      }
#if CHECK_TORQUE
      if (question[0] == 4) {
        OF(_torque)(x, p, answer);
        give(answer, 3);
      }
#endif
#if CHECK_MEMORY
      if (question[0] == 1) {
        OF(_step)(&state, x, p, dt, answer);
        give(answer, 3);
        give(state.numbers, 2);
      }
#endif
#if CHECK_FIELD
      if (question[0] == 2) {
        static OF(_touch) touch;
        static real values[OF(_NODES) * OF(_COMPONENTS)];
        const int32_t some = OF(_NODES) / 3;
        OF(_touched)(x, p, &touch);
        OF(_shape)(&touch, 0, some, values);
        OF(_shape)(&touch, some, OF(_NODES) - some, values + some * OF(_COMPONENTS));
        give(values, OF(_NODES) * OF(_COMPONENTS));
      }
#endif
#endif
    }
  }
  return 0;
}
