/*
 * The C interface of the driving simulator Omnibus. The manual is docs/c.md.
 *
 * SI units and radians. World and vehicle space are right-handed, x forward (world: east), y left
 * (world: north), z up.
 *
 * A call returns a status; omnibus_last_error() has the text of what went wrong. A result is written
 * only if the status is OMNIBUS_STATUS_OK.
 *
 * A pointer argument is NULL or points to what its type says, until the call returns; texts are
 * UTF-8 and end with a zero byte. NULL gives OMNIBUS_STATUS_ARGUMENT unless the function allows it.
 * What a function hands over to the caller is released once, with the function that its text names,
 * in any order and from any thread.
 *
 * A forked child must not call these functions with what its parent has made.
 *
 * cbindgen wrote this file from client-lib/c/src; do not edit it.
 */

#pragma once

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

/**
 * A cause without a code of its own; the text names it.
 */
#define OMNIBUS_REFUSAL_OTHER 1

/**
 * The actor would be spawned inside the ground, a building or another actor.
 */
#define OMNIBUS_REFUSAL_SPAWN_COLLISION 2

/**
 * The actor was never spawned, or was destroyed.
 */
#define OMNIBUS_REFUSAL_UNKNOWN_ACTOR 3

/**
 * No blueprint has this id.
 */
#define OMNIBUS_REFUSAL_UNKNOWN_BLUEPRINT 4

/**
 * The actor, blueprint or sensor is of a kind that the command does not apply to.
 */
#define OMNIBUS_REFUSAL_WRONG_KIND 5

/**
 * A number, a count, a pose or a set of bits is outside its range.
 */
#define OMNIBUS_REFUSAL_OUT_OF_RANGE 6

/**
 * No bundle or sensor has this number.
 */
#define OMNIBUS_REFUSAL_NOT_FOUND 7

/**
 * A capacity is used up: actors or shared memory.
 */
#define OMNIBUS_REFUSAL_FULL 8

/**
 * The actor cannot do this in its present state.
 */
#define OMNIBUS_REFUSAL_WRONG_STATE 9

/**
 * Another world or a saved state replaced the world before the command was carried out.
 */
#define OMNIBUS_REFUSAL_WORLD_REPLACED 13

/**
 * The version of the declarations in this header. omnibus_connect() compares it with that of the
 * library.
 */
#define OMNIBUS_INTERFACE 4

/**
 * A car, truck, bus, motorcycle or bicycle.
 */
#define OMNIBUS_KIND_VEHICLE 1

/**
 * A pedestrian.
 */
#define OMNIBUS_KIND_WALKER 2

/**
 * A traffic light of the map.
 */
#define OMNIBUS_KIND_TRAFFIC_LIGHT 3

/**
 * Anything else that can be spawned.
 */
#define OMNIBUS_KIND_PROP 4

/**
 * Traffic drives the actor.
 */
#define OMNIBUS_FLAG_AUTOPILOT 1

/**
 * Teleports and set velocities alone move the actor.
 */
#define OMNIBUS_FLAG_KINEMATIC 2

/**
 * The actor touched something during this frame.
 */
#define OMNIBUS_FLAG_COLLIDING 4

/**
 * The handbrake is on.
 */
#define OMNIBUS_FLAG_HANDBRAKE 8

/**
 * The control selects the reverse gear.
 */
#define OMNIBUS_FLAG_REVERSE 16

/**
 * The most points of one call of omnibus_lane_ahead().
 */
#define OMNIBUS_LANE_POINTS_MAX 10000

/**
 * Camera: red, green, blue, 255; sRGB, 4 bytes a pixel.
 */
#define OMNIBUS_OUTPUT_COLOR 1

/**
 * Camera: metres along the optical axis, of a fisheye from the camera; one float a pixel.
 */
#define OMNIBUS_OUTPUT_DEPTH 2

/**
 * Camera: the semantic tag, one byte a pixel.
 */
#define OMNIBUS_OUTPUT_TAG 4

/**
 * Camera: the actor's id, or that of a static object with the top bit set; one uint32_t a pixel.
 */
#define OMNIBUS_OUTPUT_INSTANCE 8

/**
 * Lidar: x, y, z in sensor space (metres) and intensity (0 to 1), four floats a ray; zeros where
 * nothing was hit. Column by column, and in each column from the highest channel down.
 */
#define OMNIBUS_OUTPUT_POINTS 16

/**
 * Lidar: instance and semantic tag, two uint32_t a ray.
 */
#define OMNIBUS_OUTPUT_LABELS 32

/**
 * Lidar: as OMNIBUS_OUTPUT_POINTS, of the last return of each ray, or of the second strongest if the last
 * is the strongest.
 */
#define OMNIBUS_OUTPUT_LAST_POINTS 256

/**
 * Lidar: as OMNIBUS_OUTPUT_LABELS, of the returns of OMNIBUS_OUTPUT_LAST_POINTS.
 */
#define OMNIBUS_OUTPUT_LAST_LABELS 512

/**
 * Lidar: each column starts where the sensor was at its time, and its points are in sensor space at that
 * time. Needs rotation_rate_hz or prism_hz.
 */
#define OMNIBUS_LIDAR_SWEEP 1

/**
 * Lidar: fog, rain and spray attenuate pulses and reflect them.
 */
#define OMNIBUS_LIDAR_WEATHER 2

/**
 * The most measurements of one bundle that may be held at a time.
 */
#define OMNIBUS_HELD_MAX 7

/**
 * Lens: a pinhole.
 */
#define OMNIBUS_LENS_PINHOLE 0

/**
 * Lens: radial and tangential distortion (Brown 1971); coefficients k1, k2, p1, p2, k3 as in OpenCV's calib3d.
 */
#define OMNIBUS_LENS_BROWN_CONRADY 1

/**
 * Lens: a fisheye (Kannala and Brandt 2006); coefficients k1 to k4 as in OpenCV's fisheye. Depth is the
 * distance from the camera.
 */
#define OMNIBUS_LENS_FISHEYE 2

/**
 * Exposure: by the weather, the same for every image of a weather.
 */
#define OMNIBUS_EXPOSURE_WEATHER 0

/**
 * Exposure: by the brightness of the image itself.
 */
#define OMNIBUS_EXPOSURE_AUTOMATIC 1

/**
 * Exposure: by iso, shutter_secs and f_number.
 */
#define OMNIBUS_EXPOSURE_MANUAL 2

/**
 * What a call returned.
 */
typedef enum OmnibusStatus {
  /**
   * It did what it says.
   */
  OMNIBUS_STATUS_OK = 0,
  /**
   * An argument is NULL, not UTF-8, not finite, or out of its range.
   */
  OMNIBUS_STATUS_ARGUMENT = 1,
  /**
   * No such simulator runs, or shared memory cannot be used.
   */
  OMNIBUS_STATUS_CONNECTION = 2,
  /**
   * Header, library and simulator are not of one build.
   */
  OMNIBUS_STATUS_BUILD = 3,
  /**
   * The simulator refused a command; omnibus_last_refusal() says why. The world is as it was.
   */
  OMNIBUS_STATUS_REFUSED = 4,
  /**
   * The state of client or world does not allow it: another client holds the tick, this one
   * holds it, the world runs on its own clock, or another thread is inside a call.
   */
  OMNIBUS_STATUS_NOT_ALLOWED = 5,
  /**
   * A frame ended without a stage, which was late or died. The frame was taken in nevertheless.
   */
  OMNIBUS_STATUS_INCOMPLETE = 6,
  /**
   * The simulator has ended.
   */
  OMNIBUS_STATUS_ENDED = 7,
  /**
   * Something did not come in time.
   */
  OMNIBUS_STATUS_TIMEOUT = 8,
  /**
   * As many measurements are held as the bundle allows.
   */
  OMNIBUS_STATUS_HELD = 9,
  /**
   * The bundle was destroyed with its world; create it again.
   */
  OMNIBUS_STATUS_WORLD_GONE = 10,
  /**
   * The map cannot be read.
   */
  OMNIBUS_STATUS_MAP = 11,
  /**
   * Any other cause; the text names it.
   */
  OMNIBUS_STATUS_OTHER = 12,
  /**
   * A defect of the library; please report the text.
   */
  OMNIBUS_STATUS_DEFECT = 13,
} OmnibusStatus;

/**
 * A camera, lidar or radar in the simulator, and the stream of its measurements. One thread at a time
 * uses it.
 */
typedef struct OmnibusBundle OmnibusBundle;

/**
 * A connection to a running simulator. One thread at a time uses it: a call while another thread
 * is inside a call returns OMNIBUS_STATUS_NOT_ALLOWED.
 */
typedef struct OmnibusClient OmnibusClient;

/**
 * What a bundle measured at one frame, in the renderer's own memory. Any number of threads may
 * read it.
 */
typedef struct OmnibusMeasurement OmnibusMeasurement;

/**
 * A rigid transform outer_from_inner.
 */
typedef struct OmnibusPose {
  /**
   * Origin of the inner space in the outer space, metres.
   */
  float position_m[3];
  /**
   * Rotation of the inner axes in the outer space: a unit quaternion x, y, z, w.
   */
  float rotation_xyzw[4];
} OmnibusPose;

/**
 * One actor at one frame, where the simulator wrote it. Vehicle space is x forward, y left, z up,
 * with its origin on the ground below the middle of the wheelbase.
 */
typedef struct OmnibusActor {
  /**
   * The id, never reused within an episode.
   */
  uint32_t actor_id;
  /**
   * Index of the blueprint in the catalogue.
   */
  uint32_t blueprint;
  /**
   * One of OMNIBUS_KIND_….
   */
  uint32_t kind;
  /**
   * Bits OMNIBUS_FLAG_…; others may be set.
   */
  uint32_t flags;
  /**
   * world_from_actor.
   */
  struct OmnibusPose pose;
  /**
   * Velocity of the origin in world space, m/s.
   */
  float velocity_mps[3];
  /**
   * Angular velocity in world space, rad/s.
   */
  float angular_velocity_radps[3];
  /**
   * Mean acceleration over the frame in world space, without gravity, m/s².
   */
  float acceleration_mps2[3];
  /**
   * Vehicles: accelerator pedal, 0 to 1.
   */
  float throttle;
  /**
   * Vehicles: brake pedal, 0 to 1.
   */
  float brake;
  /**
   * Vehicles: steering wheel, -1 (full right) to 1 (full left).
   */
  float steer;
  /**
   * Vehicles: -1 reverse, 0 neutral, 1 and up forward.
   */
  int32_t gear;
  /**
   * Vehicles: engine speed, revolutions per minute.
   */
  float engine_rpm;
  /**
   * Vehicles: angle of the front wheels, positive to the left, rad.
   */
  float wheel_steer_rad;
  /**
   * Vehicles: rotation of the wheels modulo one turn, rad.
   */
  float wheel_spin_rad;
  /**
   * Traffic lights: 0 red, 1 yellow, 2 green, 3 off. Walkers: how much of a stride is done, of
   * 65536.
   */
  uint32_t phase;
  /**
   * Traffic lights: index of the signal.
   */
  uint32_t signal;
  /**
   * Paint: red, green, blue, alpha; sRGB.
   */
  uint8_t color_rgba[4];
  /**
   * Vehicles: bits of the lights that are on.
   */
  uint32_t lights;
  /**
   * Vehicles: bits of the doors that are open: front left, front right, rear left, rear right.
   */
  uint32_t doors;
} OmnibusActor;

/**
 * The world at the frame that was taken in last.
 */
typedef struct OmnibusWorld {
  /**
   * The frame.
   */
  uint64_t frame;
  /**
   * Simulated time since the world was loaded.
   */
  uint64_t sim_time_nanos;
  /**
   * A hash of everything that decides the future.
   */
  uint64_t state_hash;
  /**
   * When the host sent the snapshot: nanoseconds of omnibus_clock_nanos().
   */
  uint64_t published_nanos;
  /**
   * Every actor, sorted by id, in shared memory. Read-only.
   */
  const struct OmnibusActor *actors;
  /**
   * The number of actors.
   */
  size_t actor_count;
  /**
   * The number of the world, from 1: loading a world raises it.
   */
  uint32_t episode;
} OmnibusWorld;

/**
 * Pedals and wheel of one vehicle; the latest that was sent holds.
 */
typedef struct OmnibusControl {
  /**
   * The vehicle.
   */
  uint32_t actor_id;
  /**
   * OMNIBUS_FLAG_HANDBRAKE and OMNIBUS_FLAG_REVERSE, or 0.
   */
  uint32_t flags;
  /**
   * Accelerator pedal, 0 to 1.
   */
  float throttle;
  /**
   * Brake pedal, 0 to 1.
   */
  float brake;
  /**
   * Steering wheel, -1 (full right) to 1 (full left).
   */
  float steer;
} OmnibusControl;

/**
 * Lens of a camera; all 0 is a pinhole with the field of view of its camera.
 */
typedef struct OmnibusLens {
  /**
   * One of OMNIBUS_LENS_….
   */
  uint32_t model;
  /**
   * Focal lengths along the rows and the columns of the image, pixels. Both 0: the field of view gives
   * them, and the principal point is the middle of the image.
   */
  float focal_px[2];
  /**
   * Column and row of the principal point, pixels. The centre of pixel (0, 0) lies at (0.5, 0.5): add 0.5
   * to the numbers of OpenCV and ROS.
   */
  float center_px[2];
  /**
   * Coefficients in the order of the model; the others are 0.
   */
  float coefficients[5];
  /**
   * Fisheye: largest angle between ray and optical axis, radians, at most pi; the image is black beyond.
   * 0: as far as the formula holds.
   */
  float max_angle_rad;
} OmnibusLens;

/**
 * Effects of a camera on its colour image; all 0 is none. docs/sensors.md has the formulas.
 */
typedef struct OmnibusEffects {
  /**
   * One of OMNIBUS_EXPOSURE_….
   */
  uint32_t exposure;
  /**
   * Exposure compensation, stops; an image is twice as bright with each.
   */
  float compensation_ev;
  /**
   * Automatic exposure: smallest and largest exposure value at ISO 100. Both 0: 11 and 17.
   */
  float ev_limits[2];
  /**
   * Manual exposure: sensitivity, ISO 12232.
   */
  float iso;
  /**
   * Manual exposure: exposure time.
   */
  float shutter_secs;
  /**
   * Manual exposure: focal length divided by the diameter of the entrance pupil.
   */
  float f_number;
  /**
   * Share of the natural vignetting (the fourth power of the cosine of the angle from the axis), 0 to 1.
   */
  float vignette;
  /**
   * Share of the light that the lens scatters around each point, 0 to 1.
   */
  float bloom;
  /**
   * Standard deviation of the inner part of that light, as a share of the width of the image. 0: 0.01.
   */
  float bloom_radius;
  /**
   * Share by which the red image is larger than the green one, and the green one than the blue one.
   */
  float chromatic_aberration;
  /**
   * Electrons in a pixel of exposed radiance 1 at ISO 100. 0: no noise.
   */
  float white_electrons;
  /**
   * Standard deviation of the noise of reading a pixel, electrons.
   */
  float read_electrons;
  /**
   * Colour temperature of the light that is shown white, kelvin. 0: 6500.
   */
  float temperature_k;
  /**
   * Offset of that light towards magenta, -1 to 1.
   */
  float tint;
  /**
   * The image is encoded with the power 1 / gamma. 0: with the curve of sRGB.
   */
  float gamma;
  /**
   * Slope, toe, shoulder, black clip and white clip of Unreal's filmic tone curve. All 0: the tone curve
   * of cameras without effects.
   */
  float filmic[5];
  /**
   * Rolling shutter: time from the reading of the first row to that of the last, which is the time of the
   * frame. It bends every image of the camera.
   */
  float readout_secs;
  /**
   * Motion blur: time before that of the frame during which each row is exposed. 0: an instant.
   */
  float blur_secs;
  /**
   * Diameter of the entrance pupil, metres, which gives the depth of field. 0: everything is sharp.
   */
  float aperture_m;
  /**
   * Distance along the optical axis of what is sharp, metres.
   */
  float focus_m;
} OmnibusEffects;

/**
 * A camera; pixel (0, 0) is at the top left.
 */
typedef struct OmnibusCamera {
  /**
   * parent_from_sensor: in the space of the actor that carries it. Sensor space is x forward,
   * y left, z up.
   */
  struct OmnibusPose pose;
  /**
   * Width of the image, pixels.
   */
  uint32_t width;
  /**
   * Height of the image, pixels.
   */
  uint32_t height;
  /**
   * Horizontal field of view, radians, above 0 and below pi, of a fisheye below 2 pi; pixels are square.
   * Without effect if the lens has focal lengths.
   */
  float fov_rad;
  /**
   * Bits OMNIBUS_OUTPUT_… of a camera, at least one.
   */
  uint32_t outputs;
  /**
   * How many measurements may be held at a time, 1 to OMNIBUS_HELD_MAX.
   */
  uint32_t held_max;
  /**
   * Lens.
   */
  struct OmnibusLens lens;
  /**
   * Effects on the colour image.
   */
  struct OmnibusEffects effects;
} OmnibusCamera;

/**
 * A lidar. All fields from rotation_rate_hz on may be 0: it measures its whole field of view in every
 * frame, without noise.
 */
typedef struct OmnibusLidar {
  /**
   * parent_from_sensor: in the space of the actor that carries it. Sensor space is x forward,
   * y left, z up.
   */
  struct OmnibusPose pose;
  /**
   * Number of channels (beams), spaced equally between the two elevations.
   */
  uint32_t channels;
  /**
   * Azimuth steps.
   */
  uint32_t columns;
  /**
   * Horizontal field of view, radians; 2 pi is a full turn.
   */
  float fov_rad;
  /**
   * Elevation of the lowest channel, radians, positive upwards.
   */
  float lower_rad;
  /**
   * Elevation of the highest channel, radians, positive upwards.
   */
  float upper_rad;
  /**
   * Longest range, metres.
   */
  float range_m;
  /**
   * Bits OMNIBUS_OUTPUT_… of a lidar, at least one.
   */
  uint32_t outputs;
  /**
   * How many measurements may be held at a time, 1 to OMNIBUS_HELD_MAX.
   */
  uint32_t held_max;
  /**
   * Revolutions per second; 0: the whole field of view at one instant.
   */
  float rotation_rate_hz;
  /**
   * Turns per second of the two prisms of a Risley scanner, whose beams draw a rosette with the diameter
   * fov_rad; both 0: columns and channels.
   */
  float prism_hz[2];
  /**
   * Standard deviation of the range, metres.
   */
  float noise_m;
  /**
   * Full angle of the cone of a beam, radians, at most 0.1; 0: a ray.
   */
  float divergence_rad;
  /**
   * Bits OMNIBUS_LIDAR_….
   */
  uint32_t flags;
  /**
   * Elevations of the channels, the highest first, radians; at most 128. NULL: spaced equally between
   * lower_rad and upper_rad. Read by omnibus_create_lidar() only.
   */
  const float *elevations_rad;
} OmnibusLidar;

/**
 * One output of a measurement.
 */
typedef struct OmnibusData {
  /**
   * The values, as the output says. Read-only, in shared memory; valid until the measurement is
   * released.
   */
  const void *bytes;
  /**
   * Their size in bytes.
   */
  size_t byte_len;
  /**
   * Camera: pixels across. Lidar: azimuth steps.
   */
  uint32_t width;
  /**
   * Camera: pixels down. Lidar: channels.
   */
  uint32_t height;
  /**
   * The measured frame.
   */
  uint64_t frame;
  /**
   * Simulated time of that frame.
   */
  uint64_t sim_time_nanos;
  /**
   * world_from_sensor at that frame.
   */
  struct OmnibusPose world_from_sensor;
} OmnibusData;

/**
 * The receiver of a radar, which adds up the echoes of each cell by the radar equation; docs/sensors.md
 * has the formulas. omnibus_radar_receiver() sets all fields.
 */
typedef struct OmnibusRadarReceiver {
  /**
   * Carrier frequency, hertz. 0: the radar has no receiver.
   */
  float frequency_hz;
  /**
   * Transmitted power, decibels above a milliwatt.
   */
  float transmit_power_dbm;
  /**
   * Gain of each of the two antennas, decibels.
   */
  float antenna_gain_db;
  /**
   * Noise of a cell, with the losses and after integration, decibels above a milliwatt.
   */
  float noise_dbm;
  /**
   * Least ratio of signal to noise of a detection, decibels.
   */
  float snr_min_db;
  /**
   * Size of a cell: distance in metres, azimuth in radians, range rate in metres per second.
   */
  float cell[3];
  /**
   * Not 0: walls that mirror the beam show ghosts of actors behind them.
   */
  uint32_t has_ghosts;
} OmnibusRadarReceiver;

/**
 * A radar.
 */
typedef struct OmnibusRadar {
  /**
   * parent_from_sensor: in the space of the actor that carries it. Sensor space is x forward,
   * y left, z up.
   */
  struct OmnibusPose pose;
  /**
   * Horizontal and vertical field of view, radians, 1 to 170 degrees.
   */
  float fov_rad[2];
  /**
   * The distance up to which it detects, metres.
   */
  float range_m;
  /**
   * Directions of omnibus_radar_detections(); those that meet nothing give no detection.
   */
  uint32_t points;
  /**
   * Seed of the directions.
   */
  uint64_t seed;
  /**
   * How many measurements may be held at a time, 1 to OMNIBUS_HELD_MAX.
   */
  uint32_t held_max;
  /**
   * Receiver, for omnibus_radar_targets(); all 0: none.
   */
  struct OmnibusRadarReceiver receiver;
} OmnibusRadar;

/**
 * What a radar met in one direction.
 */
typedef struct OmnibusRadarDetection {
  /**
   * Range rate, negative for what comes nearer, m/s.
   */
  float velocity_mps;
  /**
   * Angle from the x axis of sensor space in its xy plane, positive to the left, radians.
   */
  float azimuth_rad;
  /**
   * Angle from the xy plane, positive upwards, radians.
   */
  float altitude_rad;
  /**
   * Distance, metres.
   */
  float depth_m;
  /**
   * The actor's id, or that of a static object with the top bit set.
   */
  uint32_t instance;
  /**
   * The semantic tag.
   */
  uint32_t tag;
} OmnibusRadarDetection;

/**
 * A cell that the receiver of a radar detected.
 */
typedef struct OmnibusRadarTarget {
  /**
   * Mean of the cell by power, and the actor or object of its strongest part.
   */
  struct OmnibusRadarDetection detection;
  /**
   * Received power, decibels above a milliwatt.
   */
  float power_dbm;
  /**
   * Ratio of signal to noise, decibels.
   */
  float snr_db;
  /**
   * Cross-section, decibels above a square metre.
   */
  float cross_section_dbsm;
  /**
   * Not 0: a wall mirrored it.
   */
  uint32_t is_ghost;
} OmnibusRadarTarget;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Returns the text of the last call that failed on this thread; an empty text if none failed. It
 * is valid until the next call that fails on this thread.
 */
const char *omnibus_last_error(void);

/**
 * Returns why the simulator refused the last call that failed on this thread: an
 * OMNIBUS_REFUSAL_… number, or 0 if it was no refusal.
 */
uint32_t omnibus_last_refusal(void);

/**
 * Returns the version of the library and of what it shares with the simulator, as
 * "0.1.0 (build 0123456789abcdef)". `omnibus --version` prints that of the program, which must be
 * the same. The text is never freed.
 */
const char *omnibus_build(void);

/**
 * Connects to the simulator of the name `instance`, or with NULL to the only one that runs. `name`
 * is that of the client, unique in its simulator: commands of one frame are carried out in the
 * order of names. `interface` is OMNIBUS_INTERFACE.
 *
 * `*client` belongs to the caller until it is given to omnibus_close().
 */
enum OmnibusStatus omnibus_connect(uint32_t interface,
                                   const char *name,
                                   const char *instance,
                                   struct OmnibusClient **client);

/**
 * Ends a connection and frees it; NULL is ignored. Bundles and measurements stay valid and are
 * released on their own; the actors of omnibus_world() are not. Actors that it spawned stay in the
 * simulator.
 */
void omnibus_close(struct OmnibusClient *client);

/**
 * Sets how long calls wait: for a frame, at first without a limit (INFINITY), and for the outcome
 * of a command or a measurement, at first 30 s. Both in seconds.
 */
enum OmnibusStatus omnibus_set_timeouts(const struct OmnibusClient *client,
                                        double frame_secs,
                                        double answer_secs);

/**
 * Takes the tick and makes the world wait for it: each omnibus_tick() is `delta_secs` of simulated
 * time long, 0.0001 to 10 s.
 */
enum OmnibusStatus omnibus_synchronise(const struct OmnibusClient *client, double delta_secs);

/**
 * Lets the world run on its own clock, at `factor` simulated seconds per real second; it waits for
 * no client.
 */
enum OmnibusStatus omnibus_run_freely(const struct OmnibusClient *client, double factor);

/**
 * Advances the world by one tick and takes the new frame in. When it returns, every participant
 * has done its work for the frame, and its measurements are in their bundles. `frame` may be NULL.
 */
enum OmnibusStatus omnibus_tick(const struct OmnibusClient *client, uint64_t *frame);

/**
 * Waits until a newer frame than the one that was taken in last is published, and takes the newest
 * in: for clients that do not tick. `frame` may be NULL.
 */
enum OmnibusStatus omnibus_await_frame(const struct OmnibusClient *client, uint64_t *frame);

/**
 * Takes the newest frame in, without waiting; `*is_newer` says whether it is newer than the one
 * before. `is_newer` may be NULL.
 */
enum OmnibusStatus omnibus_refresh(const struct OmnibusClient *client, bool *is_newer);

/**
 * Makes every tick of another client wait until this one has called omnibus_arrive() for the
 * frame. Not for the client that ticks.
 */
enum OmnibusStatus omnibus_join_barrier(const struct OmnibusClient *client);

/**
 * Reports that this client's work for the frame that it took in last is done.
 */
enum OmnibusStatus omnibus_arrive(const struct OmnibusClient *client);

/**
 * Lets ticks pass without waiting for this client.
 */
enum OmnibusStatus omnibus_leave_barrier(const struct OmnibusClient *client);

/**
 * Returns the world at the frame that was taken in last. Nothing is copied: `world->actors` is the
 * simulator's own memory. It is valid until the next omnibus_tick(), omnibus_await_frame(),
 * omnibus_refresh() or omnibus_close() of this client.
 */
enum OmnibusStatus omnibus_world(const struct OmnibusClient *client, struct OmnibusWorld *world);

/**
 * Finds one actor at the frame that was taken in last. `*actor` is valid as long as the actors of
 * omnibus_world().
 */
enum OmnibusStatus omnibus_actor(const struct OmnibusClient *client,
                                 uint32_t actor_id,
                                 const struct OmnibusActor **actor);

/**
 * Returns the monotonic clock of the machine, nanoseconds: that of published_nanos.
 */
uint64_t omnibus_clock_nanos(void);

/**
 * Spawns an actor of a blueprint, as "vehicle.tesla.model3", at world_from_actor `*pose`; a vehicle
 * is set onto the road below it. `flags` are OMNIBUS_FLAG_AUTOPILOT and OMNIBUS_FLAG_KINEMATIC, or
 * 0. It exists when this returns; the next frame shows it.
 */
enum OmnibusStatus omnibus_spawn(const struct OmnibusClient *client,
                                 const char *blueprint,
                                 const struct OmnibusPose *pose,
                                 uint32_t flags,
                                 uint32_t *actor_id);

/**
 * Destroys an actor, and every bundle on it.
 */
enum OmnibusStatus omnibus_destroy(const struct OmnibusClient *client, uint32_t actor_id);

/**
 * Sets pedals and wheels of `count` vehicles from the next frame on. Does not wait; a vehicle that
 * does not exist is ignored. All numbers are checked before any is sent.
 */
enum OmnibusStatus omnibus_control(const struct OmnibusClient *client,
                                   const struct OmnibusControl *controls,
                                   size_t count);

/**
 * Writes up to `capacity` poses for vehicles, half a metre above the road, to `poses`, and the
 * number of all to `*count`. With a capacity of 0, `poses` may be NULL.
 */
enum OmnibusStatus omnibus_spawn_points(const struct OmnibusClient *client,
                                        struct OmnibusPose *poses,
                                        size_t capacity,
                                        size_t *count);

/**
 * Writes up to `capacity` poses on the centre of the driving lane that is nearest to
 * `position_m` (three numbers, world space, metres): the first abeam of it, then every `spacing_m`
 * metres in driving direction, x along the lane. Where lanes fork, the first branch; fewer than
 * `capacity` where the lane ends. `*count` is the number written. The first call reads the map.
 */
enum OmnibusStatus omnibus_lane_ahead(const struct OmnibusClient *client,
                                      const float *position_m,
                                      double spacing_m,
                                      struct OmnibusPose *poses,
                                      size_t capacity,
                                      size_t *count);

/**
 * Mounts a camera on an actor, or in the world (`parent` 0). It measures from the next frame on.
 * `*bundle` belongs to the caller until it is given to omnibus_destroy_bundle().
 */
enum OmnibusStatus omnibus_create_camera(const struct OmnibusClient *client,
                                         const char *name,
                                         uint32_t parent,
                                         const struct OmnibusCamera *camera,
                                         struct OmnibusBundle **bundle);

/**
 * Mounts a lidar: as omnibus_create_camera().
 */
enum OmnibusStatus omnibus_create_lidar(const struct OmnibusClient *client,
                                        const char *name,
                                        uint32_t parent,
                                        const struct OmnibusLidar *lidar,
                                        struct OmnibusBundle **bundle);

/**
 * Sets the fields of a lidar by the data sheet of a model ("vlp-16", "hdl-64e", "os1-128" or
 * "livox-mid-40"), with as many columns as it fires in `frame_secs`, the time step of the world. Pose,
 * outputs, held_max, divergence_rad and flags are left to the caller.
 */
enum OmnibusStatus omnibus_lidar_model(const char *model,
                                       double frame_secs,
                                       struct OmnibusLidar *lidar);

/**
 * Returns the newest measurement that was not received yet; older ones are dropped. `*measurement`
 * is NULL if there is none. Does not wait. The caller gives it to omnibus_release().
 */
enum OmnibusStatus omnibus_latest(const struct OmnibusBundle *bundle,
                                  struct OmnibusMeasurement **measurement);

/**
 * Waits for the next measurement of a bundle: for pipelined worlds, and those on their own clock.
 * The caller gives it to omnibus_release().
 */
enum OmnibusStatus omnibus_await_measurement(const struct OmnibusClient *client,
                                             const struct OmnibusBundle *bundle,
                                             struct OmnibusMeasurement **measurement);

/**
 * Returns one output of a measurement, OMNIBUS_OUTPUT_…: where it lies, without a copy.
 */
enum OmnibusStatus omnibus_data(const struct OmnibusMeasurement *measurement,
                                uint32_t output,
                                struct OmnibusData *data);

/**
 * Gives a measurement's memory back to the renderer; NULL is ignored.
 */
void omnibus_release(struct OmnibusMeasurement *measurement);

/**
 * Destroys a bundle; NULL is ignored. Its measurements stay valid until they are released.
 */
void omnibus_destroy_bundle(struct OmnibusBundle *bundle);

/**
 * Sets a receiver to that of a long-range radar of 77 GHz, which detects a car of 10 square metres up to
 * 280 m; cells of 0.4 m, 1.6 degrees and 0.1 m/s; no ghosts.
 */
enum OmnibusStatus omnibus_radar_receiver(struct OmnibusRadarReceiver *receiver);

/**
 * Mounts a radar: as omnibus_create_camera(). Its rays are those of a lidar: omnibus_data() has
 * OMNIBUS_OUTPUT_POINTS and OMNIBUS_OUTPUT_LABELS of its measurements.
 */
enum OmnibusStatus omnibus_create_radar(const struct OmnibusClient *client,
                                        const char *name,
                                        uint32_t parent,
                                        const struct OmnibusRadar *radar,
                                        struct OmnibusBundle **bundle);

/**
 * Writes up to `capacity` detections of a radar to `detections`, one for each of its random directions
 * that met something, and the number of all to `*count`; at most OmnibusRadar.points. The client must have
 * taken in the frame of the measurement, whose velocities are used. With a capacity of 0, `detections` may
 * be NULL.
 */
enum OmnibusStatus omnibus_radar_detections(const struct OmnibusClient *client,
                                            const struct OmnibusMeasurement *measurement,
                                            struct OmnibusRadarDetection *detections,
                                            size_t capacity,
                                            size_t *count);

/**
 * Writes up to `capacity` cells that the receiver of a radar detected to `targets`, in the order of
 * distance, azimuth and range rate, ghosts last, and the number of all to `*count`. Otherwise as
 * omnibus_radar_detections().
 */
enum OmnibusStatus omnibus_radar_targets(const struct OmnibusClient *client,
                                         const struct OmnibusMeasurement *measurement,
                                         struct OmnibusRadarTarget *targets,
                                         size_t capacity,
                                         size_t *count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus
