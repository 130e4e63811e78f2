/* A double of Force Dimension's DHD and DRD library, with a simulated hand behind it, for trials and tests.

   It has the names, the numbers and the return codes of the Force Dimension SDK 3.16 as far as the driver uses them: 0,
   1 for a time guard, 2 for saturated motors, -1 with an error. The axes are the device's: x towards the user, y right,
   z up. The hand is a mass on a spring whose other end moves up and down by a sine, with damping.

   double_set and double_get change and read a setting or count by its name, see `settings` below; double_reset puts all
   back. With "manual" 1 the time stands still until "time" is set, and dhdSleep moves it on: tests need no clock. */

#define _GNU_SOURCE
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#ifdef _WIN32
#include <windows.h>
#define EXPORT __declspec(dllexport)
#define this_thread() ((unsigned long)GetCurrentThreadId())
#else
#include <pthread.h>
#define EXPORT __attribute__((visibility("default")))
#define this_thread() ((unsigned long)pthread_self())
#endif

/* what a compilation may set: -DTYPE=33.0 */
#ifndef TYPE
#define TYPE 33 /* omega.3 */
#endif
#ifndef AMPLITUDE
#define AMPLITUDE 0.03
#endif
#ifndef FREQUENCY
#define FREQUENCY 0.5
#endif
#ifndef HOMED
#define HOMED 1
#endif
#ifndef MOTOR_FORCE
#define MOTOR_FORCE 1000
#endif
#ifndef LOST_AFTER
#define LOST_AFTER 0
#endif

enum { NONE, ERROR, COMMUNICATION, BUSY, NO_DRIVER, NO_DEVICE, NOT_AVAILABLE, TIMEOUT, GEOMETRY, EXPERT_OFF,
       NOT_IMPLEMENTED, MEMORY, NOT_READY, FILE_MISSING, CONFIGURATION, INDEX, DEPRECATED, NULL_ARGUMENT, REDUNDANT,
       NOT_ENABLED, IN_USE, INVALID, NO_REGULATION };
static const char *const words[] = {
    "no error", "undocumented error", "communication error with the device", "the device controller is busy",
    "no device driver installed", "no compatible device found", "the command is not available on this device",
    "the operation timed out", "geometry error", "expert mode is disabled", "the command is not implemented",
    "out of memory", "the device is not ready", "a file was not found", "configuration error", "invalid device index",
    "the command is deprecated", "a null argument was given", "the redundant encoder check failed", "not enabled",
    "the device is in use by another program", "invalid argument", "no regulation"};
enum { OFF_NONE, OFF_BUTTON, OFF_VELOCITY, OFF_WATCHDOG, OFF_SOFTWARE, OFF_USB, OFF_DEAD_MAN };

typedef struct {
  /* the device; present: how many there are; hand_homes: commands until a hand has homed it, 0 for never; plain: it has no brakes, watchdog and gravity compensation; deaf: it
     takes no force limit */
  double type, serial, left_handed, present, in_use, homed, homing_fails, hand_homes, powered, device_max_force, plain, deaf;
  /* its firmware: time guard (s), speed of the velocity brake (m/s), force that the motors reach (N) */
  double time_guard, brake_speed, motor_force;
  /* buttons, as a mask */
  double buttons;
  /* the wrist: 0 none, 1 passive, 2 with motors; its turn, a rotation vector (rad); and the torque on it (N m) */
  double wrist, turn_x, turn_y, turn_z, torque_x, torque_y, torque_z;
  /* the hand: kg, N s/m, N/m, m, Hz; scripted: its place is that of the script whatever the force */
  double mass, damping, stiffness, amplitude, frequency, scripted, x, y, z;
  /* faults: commands until USB is lost; calls that fail or guard from now on; NaN as a position; garbage at first; what the
     status says */
  double lost_after, fail_position, fail_force, fail_error, fail_velocity, guard, nan, garbage, absent, broken;
  /* the clock */
  double manual, time;
  /* what was done: forces set (N), limits, and counts */
  double force_x, force_y, force_z, felt_x, felt_y, felt_z, max_force, watchdog, force_on, brakes, gravity, cause;
  double commands, saturations, guards, foreign_calls, early_calls, late_calls, opened, closed, expert, simulator;
  double sleeps, regulating, position_x, position_y, position_z, velocity_x, velocity_y, velocity_z, effector_mass, homings;
} State;

static const State start = {
    .type = TYPE, .serial = 1234, .present = 1, .homed = HOMED, .powered = 1, .device_max_force = -1,
    .time_guard = 0.0002, .brake_speed = 2.5, .motor_force = MOTOR_FORCE, .mass = 0.3, .damping = 5, .stiffness = 300,
    .amplitude = AMPLITUDE, .frequency = FREQUENCY, .lost_after = LOST_AFTER, .fail_error = COMMUNICATION, .max_force = -1,
    .brakes = 1};
static State s;

#define ENTRY(name) {#name, &s.name}
static struct { const char *name; double *value; } const settings[] = {
    ENTRY(type), ENTRY(serial), ENTRY(left_handed), ENTRY(present), ENTRY(in_use), ENTRY(homed), ENTRY(homing_fails), ENTRY(hand_homes),
    ENTRY(powered), ENTRY(device_max_force), ENTRY(plain), ENTRY(deaf), ENTRY(time_guard), ENTRY(brake_speed), ENTRY(motor_force), ENTRY(buttons),
    ENTRY(wrist), ENTRY(turn_x), ENTRY(turn_y), ENTRY(turn_z), ENTRY(torque_x), ENTRY(torque_y), ENTRY(torque_z),
    ENTRY(mass), ENTRY(damping), ENTRY(stiffness), ENTRY(amplitude), ENTRY(frequency), ENTRY(scripted), ENTRY(x),
    ENTRY(y), ENTRY(z), ENTRY(lost_after), ENTRY(fail_position), ENTRY(fail_force), ENTRY(fail_error),
    ENTRY(fail_velocity), ENTRY(guard), ENTRY(nan), ENTRY(garbage), ENTRY(absent), ENTRY(broken), ENTRY(manual), ENTRY(time), ENTRY(force_x),
    ENTRY(force_y), ENTRY(force_z), ENTRY(felt_x), ENTRY(felt_y), ENTRY(felt_z), ENTRY(max_force), ENTRY(watchdog),
    ENTRY(force_on), ENTRY(brakes), ENTRY(gravity), ENTRY(cause), ENTRY(commands), ENTRY(saturations), ENTRY(guards),
    ENTRY(foreign_calls), ENTRY(early_calls), ENTRY(late_calls), ENTRY(opened), ENTRY(closed), ENTRY(expert),
    ENTRY(simulator), ENTRY(sleeps), ENTRY(regulating), ENTRY(position_x), ENTRY(position_y), ENTRY(position_z), ENTRY(velocity_x),
    ENTRY(velocity_y), ENTRY(velocity_z), ENTRY(effector_mass), ENTRY(homings)};

static int error;               /* the last one */
static bool is_open, running;   /* running: the hand has a past to move on from */
static unsigned long owner;     /* the thread that opened it */
static double began, last;      /* of the hand, s */
static double commanded, seen;  /* times of the last force and of the last fresh position, s */
static double shown[3];         /* the last fresh position */

EXPORT void double_reset(void) {
  s = start;
  error = NONE;
  is_open = running = false;
}

__attribute__((constructor)) static void prepare(void) { double_reset(); }

static double *find(const char *name) {
  for (size_t i = 0; i < sizeof settings / sizeof *settings; i++)
    if (!strcmp(settings[i].name, name)) return settings[i].value;
  return NULL;
}

EXPORT int double_set(const char *name, double value) {
  double *place = find(name);
  if (place) *place = value;
  return place ? 0 : -1;
}

EXPORT double double_get(const char *name) {
  double *place = find(name);
  return place ? *place : NAN;
}

static double now(void) {
  struct timespec t;
  if (s.manual) return s.time;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int fail(int number) {
  error = number;
  return -1;
}

static void turn_off(int cause) {
  if (!s.force_on) return;
  s.force_on = 0;
  s.cause = cause;
  s.brakes = cause == OFF_VELOCITY;
}

/* move the hand on, with the force as the firmware lets it through */
static void advance(void) {
  double t = now(), *place = &s.position_x, *speed = &s.velocity_x, *felt = &s.felt_x;
  if (!running) began = last = t, running = true;
  if (t - last > 0.2) last = t - 0.2; /* a longer pause is cut to that */
  while (t - last > 1e-9) {
    double h = fmin(1e-3, t - last), sum = 0, wish[3] = {s.x, s.y, s.z};
    last += h;
    wish[2] -= s.amplitude * sin(2 * M_PI * s.frequency * (last - began));
    if (s.force_on && s.watchdog && last - commanded > 125e-6 * s.watchdog) turn_off(OFF_WATCHDOG);
    for (int i = 0; i < 3; i++) {
      felt[i] = s.force_on ? (&s.force_x)[i] : 0;
      if (s.scripted) {
        speed[i] = (wish[i] - place[i]) / h;
        place[i] = wish[i];
      } else {
        speed[i] += h / s.mass * (s.stiffness * (wish[i] - place[i]) - s.damping * speed[i] + felt[i]);
        place[i] += h * speed[i];
      }
      sum += speed[i] * speed[i];
    }
    if (sum > s.brake_speed * s.brake_speed) turn_off(OFF_VELOCITY);
  }
}

/* what each call on an open device begins with: 0, or -1 with an error */
static int enter(void) {
  if (this_thread() != owner && owner) s.foreign_calls++;
  if (!is_open) {
    if (s.closed) s.late_calls++; else s.early_calls++;
    return fail(NO_DEVICE);
  }
  advance();
  if (s.lost_after && s.commands >= s.lost_after) {
    turn_off(OFF_USB);
    return fail(COMMUNICATION);
  }
  return 0;
}

EXPORT int dhdGetDeviceCount(void) { return (int)s.present; }
EXPORT int dhdGetAvailableCount(void) { return s.in_use ? 0 : (int)s.present; }
EXPORT void dhdEnableSimulator(bool on) { s.simulator = on; }
EXPORT void dhdGetSDKVersion(int *major, int *minor, int *release, int *revision) {
  *major = 3, *minor = 16, *release = 1, *revision = 0;
}

EXPORT int dhdOpen(void) {
  if (!s.present) return fail(NO_DEVICE);
  if (s.in_use) return fail(IN_USE);
  owner = this_thread();
  is_open = true;
  s.opened++;
  s.force_on = s.cause = s.watchdog = s.expert = 0;
  s.brakes = 1;
  s.max_force = s.device_max_force;
  seen = -INFINITY;
  return 0;
}

EXPORT int dhdOpenID(char index) { return index < s.present || !s.present ? dhdOpen() : fail(INDEX); }
EXPORT int dhdOpenSerial(int serial) {
  return serial >= s.serial && serial < s.serial + s.present ? dhdOpen() : fail(NO_DEVICE);
}
EXPORT int dhdOpenType(int type) { return type == (int)s.type ? dhdOpen() : fail(NO_DEVICE); }
EXPORT int drdOpen(void) { return is_open ? 0 : dhdOpen(); }
EXPORT int drdOpenID(char index) { return is_open && index == 0 ? 0 : dhdOpenID(index); }

EXPORT int dhdStop(char id) {
  (void)id;
  if (enter()) return -1;
  turn_off(OFF_SOFTWARE);
  s.brakes = 1;
  return 0;
}

EXPORT int dhdClose(char id) {
  (void)id;
  if (!is_open) return s.late_calls++, fail(NO_DEVICE);
  s.force_on = 0;
  s.brakes = 1;
  is_open = false;
  s.closed++;
  return 0;
}
EXPORT int drdClose(char id) { return dhdClose(id); }

EXPORT bool drdIsInitialized(char id) {
  (void)id;
  return !enter() && s.homed;
}

EXPORT int drdAutoInit(char id) {
  (void)id;
  if (enter()) return -1;
  if (s.type == 60) return fail(NOT_AVAILABLE); /* a Falcon is homed by hand */
  s.homings++;
  s.regulating = 1;
  if (s.homing_fails) return fail(TIMEOUT);
  s.homed = 1;
  return 0;
}

EXPORT bool drdIsRunning(char id) {
  (void)id;
  return s.regulating != 0;
}

EXPORT int drdStop(bool force, char id) {
  (void)force;
  (void)id;
  if (!s.regulating) return fail(NO_REGULATION);
  s.regulating = 0;
  return enter();
}

EXPORT const char *dhdGetSystemName(char id) {
  (void)id;
  switch ((int)s.type) {
    case 32: case 33: return "omega.3";
    case 34: case 36: return "omega.6";
    case 35: case 37: return "omega.7";
    case 60: return "Falcon";
    case 31: case 63: return "delta.3";
    case 61: case 62: case 64: return "delta.6";
    case 106: case 107: return "sigma.6+";
    case 102: case 103: case 104: case 105: return "sigma.7";
    case 108: case 109: return "lambda.7";
    case 203: return "lambda.3";
    case 206: return "sigma.3";
    default: return "custom";
  }
}

EXPORT int dhdGetSystemType(char id) {
  (void)id;
  return enter() ? -1 : (int)s.type;
}

EXPORT int dhdGetSerialNumber(unsigned short *serial, char id) {
  (void)id;
  *serial = (unsigned short)s.serial;
  return enter();
}

EXPORT bool dhdIsLeftHanded(char id) {
  (void)id;
  return !enter() && s.left_handed;
}

EXPORT int dhdGetPosition(double *x, double *y, double *z, char id) {
  (void)id;
  if (enter()) return -1;
  if (s.fail_position > 0) return s.fail_position--, fail((int)s.fail_error);
  double t = now(), off = s.homed ? 0 : 0.02; /* encoders that have not been homed count from anywhere */
  bool guarded = t - seen < s.time_guard || s.guard > 0;
  if (guarded) {
    s.guards++;
    s.guard -= s.guard > 0;
  } else {
    shown[0] = s.position_x + off, shown[1] = s.position_y, shown[2] = s.position_z;
    seen = t;
  }
  *x = s.nan ? NAN : shown[0], *y = shown[1], *z = shown[2];
  if (s.garbage > 0) s.garbage--, *x = 3e7, *y = -1e-310;
  return guarded;
}

EXPORT bool dhdHasWrist(char id) {
  (void)id;
  return !enter() && s.wrist > 0;
}

EXPORT bool dhdHasActiveWrist(char id) {
  (void)id;
  return !enter() && s.wrist > 1;
}

/* the rotation of a rotation vector by Rodrigues' formula, row by row */
EXPORT int dhdGetPositionAndOrientationFrame(double *x, double *y, double *z, double *frame, char id) {
  int code = dhdGetPosition(x, y, z, id);
  double w[3] = {s.turn_x, s.turn_y, s.turn_z}, angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  double a = angle > 0 ? sin(angle) / angle : 1, b = angle > 0 ? (1 - cos(angle)) / (angle * angle) : 0.5;
  double cross[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
  if (code < 0) return code;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      frame[3 * i + j] = (i == j) * cos(angle) + a * cross[3 * i + j] + b * w[i] * w[j];
  return code;
}

EXPORT int dhdConfigLinearVelocity(int window, int mode, char id) {
  (void)window, (void)mode, (void)id;
  return enter();
}

EXPORT int dhdGetLinearVelocity(double *x, double *y, double *z, char id) {
  (void)id;
  if (enter()) return -1;
  if (s.fail_velocity > 0) return s.fail_velocity--, fail(TIMEOUT); /* too few positions within the window */
  *x = s.velocity_x, *y = s.velocity_y, *z = s.velocity_z;
  return 0;
}

EXPORT int dhdSetForce(double x, double y, double z, char id) {
  (void)id;
  double norm = sqrt(x * x + y * y + z * z), share = 1;
  if (enter()) return -1;
  s.commands++;
  if (s.hand_homes && s.commands >= s.hand_homes) s.homed = 1;
  if (s.fail_force > 0) return s.fail_force--, fail((int)s.fail_error);
  if (!isfinite(norm)) return fail(INVALID);
  if (s.max_force >= 0 && norm > s.max_force) share = s.max_force / norm;
  bool saturated = share * norm > s.motor_force;
  if (saturated) share = s.motor_force / norm; /* the direction is kept */
  s.force_x = share * x, s.force_y = share * y, s.force_z = share * z;
  s.saturations += saturated;
  commanded = now();
  return saturated ? 2 : 0;
}

EXPORT int dhdSetForceAndTorque(double x, double y, double z, double a, double b, double c, char id) {
  int code = dhdSetForce(x, y, z, id);
  if (code < 0) return code;
  if (s.wrist < 2) return fail(NOT_AVAILABLE);
  s.torque_x = a, s.torque_y = b, s.torque_z = c;
  return code;
}

EXPORT int dhdEnableForce(bool on, char id) {
  (void)id;
  if (enter()) return -1;
  if (!s.powered) return fail(NOT_READY);
  s.force_on = on;
  s.cause = on ? OFF_NONE : OFF_SOFTWARE;
  commanded = now();
  return 0;
}

EXPORT int dhdSetBrakes(bool on, char id) {
  (void)id;
  if (enter()) return -1;
  if (s.plain) return fail(NOT_AVAILABLE);
  s.brakes = on;
  return 0;
}

EXPORT int dhdSetGravityCompensation(bool on, char id) {
  (void)id;
  if (enter()) return -1;
  if (s.plain) return fail(NOT_AVAILABLE);
  s.gravity = on;
  return 0;
}

EXPORT int dhdSetEffectorMass(double mass, char id) {
  (void)id;
  if (enter()) return -1;
  if (mass < 0) return fail(INVALID);
  s.effector_mass = mass;
  return 0;
}

EXPORT int dhdSetMaxForce(double force, char id) {
  (void)id;
  if (enter()) return -1;
  if (!s.deaf) s.max_force = force;
  return 0;
}

EXPORT double dhdGetMaxForce(char id) {
  (void)id;
  return enter() ? -1 : s.max_force;
}

EXPORT unsigned dhdGetButtonMask(char id) {
  (void)id;
  return enter() ? 0 : (unsigned)s.buttons;
}

EXPORT int dhdGetButton(int index, char id) { return (int)(dhdGetButtonMask(id) >> index & 1); }

EXPORT int dhdGetStatus(int *status, char id) {
  (void)id;
  int code = enter();
  memset(status, 0, 17 * sizeof *status);
  status[0] = s.powered != 0;
  status[1] = code == 0 && !s.absent;
  status[2] = is_open;
  status[3] = s.homed != 0;
  status[4] = !s.force_on && !s.brakes;
  status[5] = s.force_on != 0;
  status[6] = s.brakes != 0;
  status[9] = code != 0 || s.broken;
  status[10] = s.gravity != 0;
  status[11] = s.time_guard > 0;
  status[14] = (int)s.cause;
  return code;
}

EXPORT double dhdGetComFreq(char id) {
  (void)id;
  return enter() ? 0 : 1.0; /* kHz */
}

EXPORT int dhdEnableExpertMode(void) {
  s.expert = 1;
  return 0;
}

EXPORT int dhdSetWatchdog(unsigned char ticks, char id) {
  (void)id;
  if (enter()) return -1;
  if (!s.expert) return fail(EXPERT_OFF);
  if (s.plain) return fail(NOT_AVAILABLE);
  s.watchdog = ticks;
  commanded = now();
  return 0;
}

EXPORT int dhdSetTimeGuard(int microseconds, char id) {
  (void)id;
  if (enter()) return -1;
  if (!s.expert) return fail(EXPERT_OFF);
  s.time_guard = microseconds < 0 ? start.time_guard : 1e-6 * microseconds;
  return 0;
}

EXPORT void dhdSleep(double seconds) {
  s.sleeps++;
  if (s.manual) {
    s.time += seconds;
    if (is_open) advance();
    return;
  }
  struct timespec t = {(time_t)seconds, (long)(1e9 * fmod(seconds, 1.0))};
  nanosleep(&t, NULL);
}

EXPORT double dhdGetTime(void) { return now(); }
EXPORT int dhdErrorGetLast(void) { return error; }
EXPORT const char *dhdErrorGetStr(int number) {
  return number >= 0 && number <= NO_REGULATION ? words[number] : "unknown error";
}
EXPORT const char *dhdErrorGetLastStr(void) { return dhdErrorGetStr(error); }
