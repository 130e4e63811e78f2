/* A double of 3D Systems' OpenHaptics HD library, for trials and tests without hardware.

   Names, types and numbers are those of the HD headers (hdDevice, hdDefines, hdScheduler, 3.30), as far as a driver of
   one device needs them. Behind them is a mass on a spring whose other end moves up and down by a sine, with damping:
   x right, y up, z towards the user, in mm as the library has it. A thread of the library's own calls the callbacks.

   It has the library's faults, too. double_set(name, value) switches them and double_get(name) counts; the names are
   in the table `entries` below. With "manual" the thread waits until double_step(n) asks it for n frames. */

#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#ifndef AMPLITUDE
#define AMPLITUDE 0.03 /* m, downwards first */
#endif
#ifndef FREQUENCY
#define FREQUENCY 0.5 /* Hz */
#endif
#ifndef MODEL
#define MODEL 0 /* Touch; see `models` below */
#endif
#ifndef LOST_AFTER
#define LOST_AFTER 0 /* frames after which the cable is pulled; 0 for never */
#endif
#ifndef WARM_EVERY
#define WARM_EVERY 0 /* frames from one complaint of warm motors to the next; 0 for none */
#endif
#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

typedef unsigned int HHD, HDerror, HDenum, HDCallbackCode;
typedef unsigned long HDSchedulerHandle, HDulong;
typedef unsigned short HDushort;
typedef unsigned char HDboolean;
typedef struct {
    HDerror errorCode;
    int internalErrorCode;
    HHD hHD;
} HDErrorInfo;
typedef HDCallbackCode (*HDSchedulerCallback)(void *);

enum { INVALID_ENUM = 0x0100, INVALID_VALUE, INVALID_OPERATION, INVALID_INPUT_TYPE, INVALID_HANDLE };
enum { WARM_MOTORS = 0x0200, EXCEEDED_MAX_FORCE = 0x0201, FORCE_ERROR = 0x0204 };
enum { DEVICE_FAULT = 0x0300, ALREADY_INITIATED = 0x0301, COMMUNICATION = 0x0302 };
enum { ILLEGAL_BEGIN = 0x0400, ILLEGAL_END = 0x0401, SCHEDULER_FULL = 0x0501, INVALID_LICENSE = 0x0600 };
enum { FORCE_OUTPUT = 0x4000, MAX_FORCE_CLAMPING = 0x4001, CAPABILITIES = 5 };
enum { CALIBRATION_OK = 0x5000 };
#define NO_DEVICE 0xFFFFFFFFu
#define HANDLE 1u
#define ERRORS 64
#define CALLBACKS 8

/* What a test sets, with what it starts from, and what it counts. */
static struct {
    double present, licence, manual, manual_after, speed, gives_limits, max_force, continuous, stiffness, clamps, offset_y;
    double calibration, calibration_style, calibrates, inkwell, safety_switch, buttons, model;
    double input_dof, output_dof, turn_x, turn_y, turn_z, torque_x, torque_y, torque_z;
    double error, error_frames, off_frames, lost, garbage, fixed, x, y, z, counting,
        lost_after, warm_every;
    double frames, begins, illegal, outside, invalid, null_names, largest, force_x, force_y, force_z, enabled, open,
        scheduled, running, rate, exceeded, uneven;
} s, fresh = {.present = 1, .licence = 1, .speed = 1, .gives_limits = 1, .max_force = 3.3, .continuous = 0.88,
              .stiffness = 1.26, .clamps = 1, .calibration = CALIBRATION_OK, .calibration_style = 4, .calibrates = 1,
              .off_frames = 50, .rate = 1000, .model = MODEL, .input_dof = 6, .output_dof = 3, .lost_after = LOST_AFTER,
              .warm_every = WARM_EVERY};
#define ENTRY(name) {#name, &s.name}
static const struct {
    const char *name;
    double *value;
} entries[] = {
    ENTRY(present),      /* 0: no device of that name */
    ENTRY(licence),      /* 0: refused for want of a licence */
    ENTRY(manual),       /* 1: frames only by double_step */
    ENTRY(manual_after), /* not 0: number of frames after which manual becomes 1 */
    ENTRY(speed),        /* times as many frames a second as the scheduler's rate */
    ENTRY(gives_limits), /* 0: knows neither nominal limits nor workspaces */
    ENTRY(max_force), ENTRY(continuous), /* N */
    ENTRY(stiffness),                    /* N/mm */
    ENTRY(clamps),                       /* 0: forces over the maximum are an error though clamping is enabled */
    ENTRY(offset_y),                     /* mm, of the workspace's centre */
    ENTRY(calibration), ENTRY(calibration_style), /* state, and the style that mends it */
    ENTRY(calibrates),                            /* 0: an update mends nothing */
    ENTRY(inkwell), ENTRY(safety_switch), ENTRY(buttons),
    ENTRY(model),        /* 0 Touch, 1 Touch X, 2 PHANTOM Desktop, 3 PHANTOM Omni, 4 another */
    ENTRY(input_dof), ENTRY(output_dof), /* 6: tells its orientation, renders torques */
    ENTRY(turn_x), ENTRY(turn_y), ENTRY(turn_z), /* rad, the handle's rotation vector */
    ENTRY(torque_x), ENTRY(torque_y), ENTRY(torque_z), /* mN m on the hand */
    ENTRY(error), ENTRY(error_frames), /* code of an error, and the number of next frames that raise it */
    ENTRY(off_frames),   /* frames without force after an error 0200 ... 0203 */
    ENTRY(lost),         /* 1: communication lost for good */
    ENTRY(lost_after), ENTRY(warm_every), /* frames */
    ENTRY(garbage),      /* number of next frames with nonsense as position */
    ENTRY(fixed), ENTRY(x), ENTRY(y), ENTRY(z), /* 1: reports this position, mm */
    ENTRY(counting),     /* 1: reports the number of the frame, modulo 100, as x, y and z */
    ENTRY(frames), ENTRY(begins), ENTRY(illegal), /* so far: frames of the scheduler, begun, wrongly begun or ended */
    ENTRY(outside), ENTRY(invalid), /* calls that belong into a frame, and calls with a wrong handle */
    ENTRY(null_names), ENTRY(exceeded),
    ENTRY(uneven),       /* forces of which x, y and z were not equal */
    ENTRY(largest), ENTRY(force_x), ENTRY(force_y), ENTRY(force_z), /* N on the hand */
    ENTRY(enabled),      /* capabilities, one bit each */
    ENTRY(open), ENTRY(scheduled), ENTRY(running), ENTRY(rate),
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t change = PTHREAD_COND_INITIALIZER;
static pthread_t thread;
static HDErrorInfo errors[ERRORS];
static int error_count, in_frame, pending, off, stopping;
static double hand[3], speed[3], force[3], wanted[3], seen[3], seen_speed[3], time_passed;
static struct {
    HDSchedulerCallback function;
    void *data;
    HDushort priority;
    int active, busy;
} callbacks[CALLBACKS];

static void raise_error(HDerror code) {
    if (error_count == ERRORS) {
        memmove(errors, errors + 1, (ERRORS - 1) * sizeof *errors);
        error_count--;
    }
    errors[error_count++] = (HDErrorInfo){code, (int)code + 7, HANDLE};
}

__attribute__((constructor)) API void double_reset(void) {
    s = fresh;
    error_count = in_frame = pending = off = stopping = 0;
    time_passed = 0;
    memset(callbacks, 0, sizeof callbacks);
    for (int i = 0; i < 3; i++) hand[i] = speed[i] = force[i] = wanted[i] = 0;
}

API int double_set(const char *name, double value) {
    for (size_t i = 0; i < sizeof entries / sizeof *entries; i++)
        if (!strcmp(entries[i].name, name)) {
            pthread_mutex_lock(&lock);
            *entries[i].value = value;
            pthread_cond_broadcast(&change);
            pthread_mutex_unlock(&lock);
            return 0;
        }
    return -1;
}

API double double_get(const char *name) {
    for (size_t i = 0; i < sizeof entries / sizeof *entries; i++)
        if (!strcmp(entries[i].name, name)) return *entries[i].value;
    return NAN;
}

/* Moves the hand on by one frame. */
static void move(double step) {
    const double mass = 0.3, damping = 5.0, stiffness = 300.0;
    time_passed += step;
    for (int i = 0; i < 3; i++) {
        double pull = -stiffness * hand[i] - damping * speed[i] + force[i];
        if (i == 1) pull -= stiffness * AMPLITUDE * sin(2 * M_PI * FREQUENCY * time_passed);
        speed[i] += step / mass * pull;
        hand[i] += step * speed[i];
    }
}

/* Calls every callback once, the one with the highest priority first; the lock is held before and after. */
static void call_back(void) {
    s.frames++;
    move(1.0 / s.rate);
    if (s.lost_after > 0 && s.frames >= s.lost_after) s.lost = 1;
    if (s.warm_every > 0 && fmod(s.frames, s.warm_every) == 0) s.error = WARM_MOTORS, s.error_frames = 1;
    if (off > 0) off--;
    int called[CALLBACKS] = {0};
    for (int n = 0; n < CALLBACKS; n++) {
        int best = -1;
        for (int i = 0; i < CALLBACKS; i++)
            if (callbacks[i].active && !called[i] &&
                (best < 0 || callbacks[i].priority > callbacks[best].priority))
                best = i;
        if (best < 0) break;
        called[best] = callbacks[best].busy = 1;
        pthread_mutex_unlock(&lock);
        HDCallbackCode code = callbacks[best].function(callbacks[best].data);
        pthread_mutex_lock(&lock);
        callbacks[best].busy = 0;
        if (code == 0) callbacks[best].active = 0;
    }
    s.scheduled = 0;
    for (int i = 0; i < CALLBACKS; i++) s.scheduled += callbacks[i].active;
    pthread_cond_broadcast(&change);
}

static void *schedule(void *unused) {
    (void)unused;
    struct timespec due;
    clock_gettime(CLOCK_REALTIME, &due);
    pthread_mutex_lock(&lock);
    while (!stopping) {
        if (s.manual_after > 0 && s.frames >= s.manual_after) s.manual = 1;
        if (s.manual) {
            if (pending > 0) {
                call_back();
                pending--;
                pthread_cond_broadcast(&change);
            } else
                pthread_cond_wait(&change, &lock);
            clock_gettime(CLOCK_REALTIME, &due);
            continue;
        }
        due.tv_nsec += (long)(1e9 / s.rate / s.speed);
        while (due.tv_nsec >= 1000000000L) due.tv_nsec -= 1000000000L, due.tv_sec++;
        while (!stopping && !s.manual && pthread_cond_timedwait(&change, &lock, &due) == 0) {
        }
        if (!stopping && !s.manual) call_back();
    }
    pthread_mutex_unlock(&lock);
    return NULL;
}

/* In manual mode: lets n frames pass, and returns when they have. */
API void double_step(int n) {
    pthread_mutex_lock(&lock);
    pending = n;
    pthread_cond_broadcast(&change);
    while (pending > 0 && s.running && s.manual && !stopping) pthread_cond_wait(&change, &lock);
    pthread_mutex_unlock(&lock);
}

API HHD hdInitDevice(const char *name) {
    if (name == NULL) s.null_names++;
    if (!s.licence) {
        raise_error(INVALID_LICENSE);
        return NO_DEVICE;
    }
    if (!s.present || (name != NULL && strcmp(name, "Default Device"))) {
        raise_error(DEVICE_FAULT);
        return NO_DEVICE;
    }
    if (s.open) raise_error(ALREADY_INITIATED);
    s.open = 1;
    return HANDLE;
}

static int check(HHD device) {
    if (s.open && device == HANDLE) return 1;
    s.invalid++;
    raise_error(INVALID_HANDLE);
    return 0;
}

API void hdMakeCurrentDevice(HHD device) { check(device); }
API HHD hdGetCurrentDevice(void) { return s.open ? HANDLE : NO_DEVICE; }

API void hdDisableDevice(HHD device) {
    if (!check(device)) return;
    s.open = 0;
    for (int i = 0; i < 3; i++) force[i] = 0;
    s.force_x = s.force_y = s.force_z = 0;
}

API void hdBeginFrame(HHD device) {
    if (!check(device)) return;
    if (in_frame) {
        s.illegal++;
        raise_error(ILLEGAL_BEGIN);
        return;
    }
    in_frame = 1;
    s.begins++;
    if (s.lost) {
        raise_error(COMMUNICATION);
        return; /* the last position stays */
    }
    for (int i = 0; i < 3; i++) {
        seen[i] = 1e3 * hand[i] + (i == 1 ? s.offset_y : 0);
        seen_speed[i] = 1e3 * speed[i];
    }
    if (s.fixed) seen[0] = s.x, seen[1] = s.y, seen[2] = s.z;
    if (s.counting) seen[0] = seen[1] = seen[2] = fmod(s.frames, 100);
    if (s.garbage > 0) {
        s.garbage--;
        seen[0] = 7e5;
        seen_speed[0] = 9e6;
    }
}

static void fail_force(HDerror code) {
    raise_error(code);
    off = (int)s.off_frames;
    if (code == EXCEEDED_MAX_FORCE) s.exceeded++;
}

API void hdEndFrame(HHD device) {
    if (!check(device)) return;
    if (!in_frame) {
        s.illegal++;
        raise_error(ILLEGAL_END);
        return;
    }
    in_frame = 0;
    if (s.error_frames > 0) {
        s.error_frames--;
        if (s.error >= WARM_MOTORS && s.error < FORCE_ERROR)
            fail_force((HDerror)s.error);
        else
            raise_error((HDerror)s.error);
    }
    s.uneven += wanted[0] != wanted[1] || wanted[1] != wanted[2];
    double norm = sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1] + wanted[2] * wanted[2]), share = 1;
    if (norm > 1.001 * s.max_force) {
        if (s.clamps && ((int)s.enabled & 1 << (MAX_FORCE_CLAMPING - FORCE_OUTPUT)))
            share = s.max_force / norm;
        else
            fail_force(EXCEEDED_MAX_FORCE);
    }
    if (off > 0 || s.lost || !((int)s.enabled & 1)) share = 0;
    for (int i = 0; i < 3; i++) force[i] = share * wanted[i];
    s.force_x = force[0], s.force_y = force[1], s.force_z = force[2];
    s.largest = fmax(s.largest, share * norm);
}

/* Whether a parameter belongs into a frame; one that is asked for elsewhere is refused. */
static int in_time(HDenum code) {
    int framed = code < 0x2500 || code >= 0x2700;
    if (!framed || in_frame) return 1;
    s.outside++;
    raise_error(INVALID_OPERATION);
    return 0;
}

static int give(double *values, int n, const double *source, double scale) {
    for (int i = 0; i < n; i++) values[i] = scale * source[i];
    return 1;
}

static int give_box(double *values, double x, double y, double z) {
    const double box[6] = {-x, s.offset_y - y, -z, x, s.offset_y + y, z};
    return give(values, 6, box, s.gives_limits != 0);
}

/* Refuses a parameter: one that exists is of another type than the function that was asked ('d', 'i', 'b', 's'). */
static void refuse(HDenum code, char asked) {
    char type = 0;
    if (code == 0x2000 || code == 0x2200 || (code >= 0x2553 && code <= 0x2555) || code == 0x2600 || code == 0x2601)
        type = 'i';
    else if (code == 0x2001 || code == 0x2002 || code == 0x2201 || code == 0x2202)
        type = 'b';
    else if (code >= 0x2501 && code <= 0x2505)
        type = 's';
    else if ((code >= 0x2050 && code <= 0x2052) || code == 0x2550 || code == 0x2551 ||
             (code >= 0x2602 && code <= 0x2605) || code == 0x2700)
        type = 'd';
    raise_error(type && type != asked ? INVALID_INPUT_TYPE : INVALID_ENUM);
}

/* The handle's matrix column by column: the rotation of its rotation vector by Rodrigues' formula, then its place. */
static void give_turn(double *values) {
    const double w[3] = {s.turn_x, s.turn_y, s.turn_z};
    double angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    double a = angle > 0 ? sin(angle) / angle : 1, b = angle > 0 ? (1 - cos(angle)) / (angle * angle) : 0.5;
    const double cross[3][3] = {{0, -w[2], w[1]}, {w[2], 0, -w[0]}, {-w[1], w[0], 0}};
    for (int j = 0; j < 3; j++) {
        for (int i = 0; i < 3; i++) values[4 * j + i] = (i == j) * cos(angle) + a * cross[i][j] + b * w[i] * w[j];
        values[4 * j + 3] = 0;
        values[12 + j] = seen[j];
    }
    values[15] = 1;
}

API void hdGetDoublev(HDenum code, double *values) {
    const double temperature[3] = {0.1, 0.2, 0.1};
    int known = s.gives_limits != 0;
    if (!in_time(code)) return;
    switch (code) {
    case 0x2050: give(values, 3, seen, 1); return;
    case 0x2051: give(values, 3, seen_speed, 1); return;
    case 0x2052: give_turn(values); return;
    case 0x2550: known &= give_box(values, 210, 150, 110); break;
    case 0x2551: known &= give_box(values, 80, 60, 35); break;
    case 0x2602: *values = s.stiffness; break;
    case 0x2603: *values = s.max_force; break;
    case 0x2604: *values = s.continuous; break;
    case 0x2605: give(values, 3, temperature, 1); break;
    case 0x2700: give(values, 3, wanted, 1); return;
    default: known = 0;
    }
    if (!known) refuse(code, 'd');
}

API void hdGetIntegerv(HDenum code, int *values) {
    if (!in_time(code)) return;
    switch (code) {
    case 0x2000: *values = (int)s.buttons; return;
    case 0x2553: *values = (int)s.input_dof; return;
    case 0x2554: *values = (int)s.output_dof; return;
    case 0x2555: *values = (int)s.calibration_style; return;
    case 0x2600: case 0x2601: *values = (int)s.rate; return;
    default: refuse(code, 'i');
    }
}

API void hdGetBooleanv(HDenum code, HDboolean *values) {
    if (!in_time(code)) return;
    switch (code) {
    case 0x2001: *values = s.safety_switch != 0; return;
    case 0x2002: *values = s.inkwell != 0; return;
    default: refuse(code, 'b');
    }
}

API const char *hdGetString(HDenum code) {
    static const char *models[] = {"Touch", "Touch X", "PHANTOM Desktop", "PHANTOM Omni", "Prototype"};
    switch (code) {
    case 0x2501: return models[(int)s.model];
    case 0x2502: return "double";
    case 0x2503: return "palpate";
    case 0x2504: return "0001";
    default: refuse(code, 's'); return NULL;
    }
}

API void hdSetDoublev(HDenum code, const double *values) {
    if (code == 0x2701 && s.output_dof > 5) {
        if (in_time(code)) s.torque_x = values[0], s.torque_y = values[1], s.torque_z = values[2];
    } else if (code != 0x2700)
        raise_error(INVALID_ENUM);
    else if (in_time(code))
        give(wanted, 3, values, 1);
}

static int capability(HDenum code) {
    if (code >= FORCE_OUTPUT && code < FORCE_OUTPUT + CAPABILITIES) return 1 << (code - FORCE_OUTPUT);
    raise_error(INVALID_ENUM);
    return 0;
}

API void hdEnable(HDenum code) { s.enabled = (int)s.enabled | capability(code); }
API void hdDisable(HDenum code) { s.enabled = (int)s.enabled & ~capability(code); }
API HDboolean hdIsEnabled(HDenum code) { return ((int)s.enabled & capability(code)) != 0; }

API HDErrorInfo hdGetError(void) {
    if (error_count > 0) return errors[--error_count];
    return (HDErrorInfo){0, 0, HANDLE};
}

/* As hdGetError returns its structure on 64-bit Windows. */
API void double_error_into(HDErrorInfo *place) { *place = hdGetError(); }

API const char *hdGetErrorString(HDerror code) {
    switch (code) {
    case 0: return "no error";
    case WARM_MOTORS: return "the motors are warm";
    case EXCEEDED_MAX_FORCE: return "the force exceeded the maximum";
    case COMMUNICATION: return "communication failed";
    case DEVICE_FAULT: return "device fault";
    case INVALID_LICENSE: return "no valid licence";
    default: return "an error";
    }
}

API HDenum hdCheckCalibration(void) { return (HDenum)s.calibration; }

API void hdUpdateCalibration(HDenum style) {
    if (s.calibrates && ((int)s.calibration_style & (int)style)) s.calibration = CALIBRATION_OK;
}

API void hdSetSchedulerRate(HDulong rate) {
    if (s.running || (rate != 500 && rate != 1000))
        raise_error(s.running ? INVALID_OPERATION : INVALID_VALUE);
    else
        s.rate = (double)rate;
}

API void hdStartScheduler(void) {
    if (s.running) return;
    stopping = 0;
    s.running = 1;
    pthread_create(&thread, NULL, schedule, NULL);
}

API void hdStopScheduler(void) {
    if (!s.running) return;
    pthread_mutex_lock(&lock);
    stopping = 1;
    pthread_cond_broadcast(&change);
    pthread_mutex_unlock(&lock);
    pthread_join(thread, NULL);
    s.running = 0;
}

API HDSchedulerHandle hdScheduleAsynchronous(HDSchedulerCallback function, void *data, HDushort priority) {
    pthread_mutex_lock(&lock);
    HDSchedulerHandle handle = 0;
    for (int i = 0; i < CALLBACKS && !handle; i++)
        if (!callbacks[i].active) {
            callbacks[i].function = function, callbacks[i].data = data;
            callbacks[i].priority = priority, callbacks[i].active = 1;
            handle = (HDSchedulerHandle)i + 1 + 0x100000000ul * (sizeof(HDulong) > 4);
        }
    if (!handle) raise_error(SCHEDULER_FULL);
    s.scheduled++;
    pthread_mutex_unlock(&lock);
    return handle;
}

static int slot(HDSchedulerHandle handle) { return (int)(handle & 0xffff) - 1; }

API HDboolean hdWaitForCompletion(HDSchedulerHandle handle, unsigned int wait) {
    pthread_mutex_lock(&lock);
    while (wait && callbacks[slot(handle)].active) pthread_cond_wait(&change, &lock);
    HDboolean active = callbacks[slot(handle)].active != 0;
    pthread_mutex_unlock(&lock);
    return active;
}

API void hdScheduleSynchronous(HDSchedulerCallback function, void *data, HDushort priority) {
    if (s.running)
        hdWaitForCompletion(hdScheduleAsynchronous(function, data, priority), 1);
    else
        while (function(data)) {
        }
}

API void hdUnschedule(HDSchedulerHandle handle) {
    pthread_mutex_lock(&lock);
    int i = slot(handle);
    if (!callbacks[i].active) {
        s.invalid++;
        raise_error(INVALID_HANDLE);
    }
    callbacks[i].active = 0;
    while (callbacks[i].busy) pthread_cond_wait(&change, &lock);
    pthread_mutex_unlock(&lock);
}

API double hdGetSchedulerTimeStamp(void) { return 0; }
