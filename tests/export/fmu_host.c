/* A host that calls an FMU's functions in legal and illegal orders, compiled together with the FMU's source.
 *
 *     host VERSION HASH RESOURCES STATES        states: number of continuous ones, -1 where there is no model exchange
 */
#include "palpate_fmu.c"

#define EXPECT(call, wanted)                                                                        \
  do {                                                                                              \
    const int came = (int)(call);                                                                   \
    if (came != (int)(wanted)) {                                                                    \
      fprintf(stderr, "line %d: %s gave %d, not %d\n", __LINE__, #call, came, (int)(wanted));        \
      return 1;                                                                                     \
    }                                                                                               \
  } while (0)

static int errors, warnings;

#include "fmu2_host.c"
#include "fmu3_host.c"

int main(int count, char **words) {
  if (count != 5) return 3;
  if (!strcmp(words[1], "2.0")) {
    if (orders2(words[2], words[3], atoi(words[4]))) return 1;
  } else {
    if (orders3(words[2], words[3], atoi(words[4]))) return 1;
  }
  EXPECT(errors > 5, 1);
  return 0;
}
