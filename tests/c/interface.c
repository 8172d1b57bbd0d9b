/*
 * The C interface against a running simulator: sensors, wrong arguments, a killed simulator.
 *
 *     interface INSTANCE JOB
 *
 * It ends with 0 if everything was as it must be, and else names the line.
 */

#include <math.h>
#include <omnibus.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPECT(condition)                                                                          \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "interface.c:%d: not so: %s; the last error is: %s\n", __LINE__,       \
                    #condition, omnibus_last_error());                                             \
            exit(1);                                                                               \
        }                                                                                          \
    } while (0)
#define OK(call) EXPECT((call) == OMNIBUS_STATUS_OK)
/* A failure of this status, whose text has this part. */
#define FAILS(call, code, part)                                                                    \
    do {                                                                                           \
        EXPECT((call) == OMNIBUS_STATUS_##code);                                                   \
        EXPECT(strstr(omnibus_last_error(), part) != NULL);                                        \
    } while (0)

static const OmnibusPose ROOF = {{0.0f, 0.0f, 2.0f}, {0.0f, 0.0f, 0.0f, 1.0f}};

static uint32_t spawn(const OmnibusClient *client) {
    OmnibusPose place;
    size_t count;
    uint32_t car;
    OK(omnibus_spawn_points(client, &place, 1, &count));
    EXPECT(count > 1);
    OK(omnibus_spawn(client, "vehicle.tesla.model3", &place, 0, &car));
    OK(omnibus_tick(client, NULL));
    return car;
}

static void sensors(const OmnibusClient *client) {
    uint32_t car = spawn(client);
    OmnibusCamera camera = {.pose = ROOF, .width = 64, .height = 48, .fov_rad = 1.5f, .held_max = 2,
                            .outputs = OMNIBUS_OUTPUT_COLOR | OMNIBUS_OUTPUT_DEPTH};
    OmnibusLidar lidar = {.pose = ROOF, .channels = 8, .columns = 90, .fov_rad = 6.283f,
                          .lower_rad = -0.2f, .upper_rad = 0.1f, .range_m = 50.0f, .held_max = 1,
                          .outputs = OMNIBUS_OUTPUT_POINTS};
    OmnibusBundle *eye, *roof;
    OmnibusMeasurement *image, *cloud, *later;
    OmnibusData color, depth, points;
    OmnibusWorld world;
    uint64_t frame;
    OK(omnibus_create_camera(client, "eye", car, &camera, &eye));
    OK(omnibus_create_lidar(client, "roof", car, &lidar, &roof));
    /* A lidar of a maker, with elevations of its own. */
    OmnibusLidar hdl = {.pose = ROOF, .held_max = 1, .outputs = OMNIBUS_OUTPUT_POINTS};
    OmnibusBundle *maker;
    OK(omnibus_lidar_model("hdl-64e", 0.1, &hdl));
    EXPECT(hdl.channels == 64 && hdl.columns == 2083 && hdl.elevations_rad != NULL);
    OK(omnibus_create_lidar(client, "maker", car, &hdl, &maker));
    omnibus_destroy_bundle(maker);
    hdl.flags = 64;
    FAILS(omnibus_create_lidar(client, "maker", car, &hdl, &maker), ARGUMENT, "flags are 0x40");
    FAILS(omnibus_lidar_model("hdl-65", 0.1, &hdl), ARGUMENT, "unknown model of a lidar");
    OK(omnibus_tick(client, &frame));
    OK(omnibus_world(client, &world));
    EXPECT(world.frame == frame && world.actor_count >= 1 && world.sim_time_nanos > 0);
    EXPECT(world.published_nanos <= omnibus_clock_nanos());

    OK(omnibus_latest(eye, &image));
    EXPECT(image != NULL);
    OK(omnibus_data(image, OMNIBUS_OUTPUT_COLOR, &color));
    OK(omnibus_data(image, OMNIBUS_OUTPUT_DEPTH, &depth));
    EXPECT(color.frame == frame && color.width == 64 && color.height == 48);
    EXPECT(color.byte_len == 64 * 48 * 4 && depth.byte_len == 64 * 48 * sizeof(float));
    EXPECT(((const uint8_t *)color.bytes)[3] == 255);
    /* The lowest row shows the road, two metres below and some metres ahead. */
    float low_m = ((const float *)depth.bytes)[47 * 64 + 32];
    EXPECT(low_m > 0.5f && low_m < 20.0f);
    FAILS(omnibus_data(image, OMNIBUS_OUTPUT_TAG, &depth), ARGUMENT, "0x4");

    OK(omnibus_latest(roof, &cloud));
    OK(omnibus_data(cloud, OMNIBUS_OUTPUT_POINTS, &points));
    EXPECT(points.frame == frame && points.width == 90 && points.height == 8);
    EXPECT(points.byte_len == 90 * 8 * 4 * sizeof(float));
    /* The lowest channel of the first column hits the road. */
    EXPECT(fabsf(((const float *)points.bytes)[7 * 4 + 2] + 2.0f) < 0.5f);
    OK(omnibus_latest(eye, &later));
    EXPECT(later == NULL);

    /* A measurement that is held stays as it is, and counts. */
    uint8_t first[64 * 48 * 4];
    memcpy(first, color.bytes, sizeof first);
    FAILS((omnibus_tick(client, NULL), omnibus_latest(roof, &later)), HELD, "1 measurements of this bundle are held");
    OmnibusControl control = {.actor_id = car, .throttle = 1.0f};
    OK(omnibus_control(client, &control, 1));
    for (int i = 0; i < 20; i++) {
        OK(omnibus_tick(client, NULL));
        OK(omnibus_latest(eye, &later));
        OK(omnibus_data(later, OMNIBUS_OUTPUT_COLOR, &depth));
        EXPECT(depth.bytes != color.bytes);
        omnibus_release(later);
    }
    EXPECT(memcmp(first, color.bytes, sizeof first) == 0);
    omnibus_release(cloud);
    OK(omnibus_tick(client, &frame));
    OK(omnibus_latest(roof, &later));
    OK(omnibus_data(later, OMNIBUS_OUTPUT_POINTS, &points));
    EXPECT(points.frame == frame);
    omnibus_release(later);

    /* A bundle ends before its measurement. */
    omnibus_destroy_bundle(eye);
    EXPECT(memcmp(first, color.bytes, sizeof first) == 0);
    omnibus_release(image);
    omnibus_destroy_bundle(roof);
}

/* A radar 20 m behind a car that drives away from it. */
static void radar(const OmnibusClient *client) {
    enum { POINTS = 400 };
    static OmnibusRadarDetection detections[POINTS];
    static OmnibusRadarTarget targets[4096];
    uint32_t car = spawn(client);
    const OmnibusActor *actor;
    OmnibusBundle *bundle, *plain;
    OmnibusMeasurement *measured, *other;
    OmnibusData points;
    size_t count, all, on_car = 0;
    float strongest_db = -1000.0f;
    OK(omnibus_actor(client, car, &actor));
    /* Behind the car, at half its height, in world space. */
    float w = actor->pose.rotation_xyzw[3], z = actor->pose.rotation_xyzw[2];
    float forward[2] = {1.0f - 2.0f * z * z, 2.0f * w * z};
    OmnibusRadar spec = {.pose = actor->pose, .fov_rad = {0.5f, 0.2f}, .range_m = 100.0f,
                         .points = POINTS, .seed = 3, .held_max = 2};
    for (int axis = 0; axis < 2; axis++)
        spec.pose.position_m[axis] -= 20.0f * forward[axis];
    spec.pose.position_m[2] += 0.7f;
    spec.pose.rotation_xyzw[0] = spec.pose.rotation_xyzw[1] = 0.0f;
    float length = sqrtf(z * z + w * w);
    spec.pose.rotation_xyzw[2] = z / length;
    spec.pose.rotation_xyzw[3] = w / length;
    OK(omnibus_create_radar(client, "plain", 0, &spec, &plain));
    OK(omnibus_radar_receiver(&spec.receiver));
    EXPECT(spec.receiver.frequency_hz == 77e9f && spec.receiver.has_ghosts == 0);
    OK(omnibus_create_radar(client, "radar", 0, &spec, &bundle));
    OmnibusControl control = {.actor_id = car, .throttle = 1.0f};
    OK(omnibus_control(client, &control, 1));
    for (int i = 0; i < 40; i++)
        OK(omnibus_tick(client, NULL));
    OK(omnibus_latest(bundle, &measured));
    OK(omnibus_latest(plain, &other));
    OK(omnibus_actor(client, car, &actor));
    float speed = actor->velocity_mps[0] * forward[0] + actor->velocity_mps[1] * forward[1];
    EXPECT(speed > 2.0f);

    OK(omnibus_radar_detections(client, measured, detections, POINTS, &count));
    EXPECT(count > 50 && count <= POINTS);
    for (size_t i = 0; i < count; i++) {
        const OmnibusRadarDetection *one = &detections[i];
        EXPECT(one->depth_m > 0.0f && one->depth_m < 100.0f);
        EXPECT(fabsf(one->azimuth_rad) < 0.26f && fabsf(one->altitude_rad) < 0.11f);
        if (one->instance == car) {
            float along = cosf(one->azimuth_rad) * cosf(one->altitude_rad);
            EXPECT(fabsf(one->velocity_mps - speed * along) < 0.1f * speed);
        } else {
            EXPECT(one->velocity_mps == 0.0f);
        }
    }
    /* The same directions without a receiver, and fewer of them. */
    OmnibusRadarDetection first;
    OK(omnibus_radar_detections(client, other, &first, 1, &all));
    EXPECT(all == count && memcmp(&first, &detections[0], sizeof first) == 0);
    FAILS(omnibus_radar_targets(client, other, NULL, 0, &all), ARGUMENT, "has no receiver");

    OK(omnibus_radar_targets(client, measured, targets, 4096, &count));
    EXPECT(count > 0 && count <= 4096);
    for (size_t i = 0; i < count; i++) {
        const OmnibusRadarTarget *one = &targets[i];
        /* The radar equation with the numbers of the receiver. */
        float due = 12.0f + 50.0f + 20.0f * log10f(299792458.0f / 77e9f) + one->cross_section_dbsm -
                    30.0f * log10f(12.5663706f) - 40.0f * log10f(one->detection.depth_m);
        EXPECT(fabsf(one->power_dbm - due) < 0.02f);
        EXPECT(one->snr_db >= 13.0f && fabsf(one->snr_db - one->power_dbm - 120.0f) < 1e-3f);
        EXPECT(one->is_ghost == 0);
        if (one->detection.instance == car) {
            on_car++;
            strongest_db = fmaxf(strongest_db, one->snr_db);
            EXPECT(fabsf(one->detection.velocity_mps - speed) < 0.1f * speed);
        }
    }
    EXPECT(on_car > 0 && strongest_db > 30.0f);
    OK(omnibus_data(measured, OMNIBUS_OUTPUT_POINTS, &points));
    EXPECT(points.width == 114 && points.height == 45);

    /* Of another frame, of no radar, and with numbers out of range. */
    OK(omnibus_tick(client, NULL));
    FAILS(omnibus_radar_targets(client, measured, targets, 1, &count), ARGUMENT, "before the next tick");
    omnibus_release(measured);
    omnibus_release(other);
    FAILS(omnibus_radar_detections(client, NULL, NULL, 0, &count), ARGUMENT, "measurement is NULL");
    FAILS(omnibus_radar_receiver(NULL), ARGUMENT, "receiver is NULL");
    OmnibusLidar lidar = {.pose = ROOF, .channels = 8, .columns = 90, .fov_rad = 6.283f,
                          .upper_rad = 0.1f, .range_m = 50.0f, .held_max = 1,
                          .outputs = OMNIBUS_OUTPUT_POINTS | OMNIBUS_OUTPUT_LABELS};
    OmnibusBundle *roof;
    OK(omnibus_create_lidar(client, "roof", car, &lidar, &roof));
    OK(omnibus_tick(client, NULL));
    OK(omnibus_latest(roof, &measured));
    FAILS(omnibus_radar_detections(client, measured, NULL, 0, &count), ARGUMENT, "not that of a radar");
    omnibus_release(measured);
    omnibus_destroy_bundle(roof);
    spec.receiver.cell[1] = 0.0f;
    FAILS(omnibus_create_radar(client, "x", 0, &spec, &roof), ARGUMENT, "azimuth of a cell is 0");
    spec.fov_rad[0] = 4.0f;
    FAILS(omnibus_create_radar(client, "x", 0, &spec, &roof), ARGUMENT, "field of view is 4");
    omnibus_destroy_bundle(bundle);
    omnibus_destroy_bundle(plain);
}

static void wrong(const OmnibusClient *client) {
    OmnibusPose place, bad = ROOF;
    OmnibusWorld world;
    OmnibusClient *other;
    OmnibusBundle *bundle;
    OmnibusMeasurement *measurement;
    const OmnibusActor *actor;
    size_t count;
    uint32_t id, car = spawn(client);
    OmnibusControl control = {.actor_id = car, .throttle = NAN};

    /* NULL, wherever a pointer is taken. */
    FAILS(omnibus_connect(OMNIBUS_INTERFACE, NULL, NULL, &other), ARGUMENT, "name is NULL");
    FAILS(omnibus_connect(OMNIBUS_INTERFACE, "x", NULL, NULL), ARGUMENT, "client is NULL");
    FAILS(omnibus_tick(NULL, NULL), ARGUMENT, "omnibus_tick: client is NULL");
    FAILS(omnibus_world(client, NULL), ARGUMENT, "world is NULL");
    FAILS(omnibus_world(NULL, &world), ARGUMENT, "client is NULL");
    FAILS(omnibus_actor(client, car, NULL), ARGUMENT, "actor is NULL");
    FAILS(omnibus_spawn(client, NULL, &ROOF, 0, &id), ARGUMENT, "blueprint is NULL");
    FAILS(omnibus_spawn(client, "vehicle.audi.a2", NULL, 0, &id), ARGUMENT, "pose is NULL");
    FAILS(omnibus_spawn(client, "vehicle.audi.a2", &ROOF, 0, NULL), ARGUMENT, "actor_id is NULL");
    FAILS(omnibus_control(client, NULL, 3), ARGUMENT, "controls is NULL");
    FAILS(omnibus_spawn_points(client, NULL, 1, &count), ARGUMENT, "poses is NULL");
    FAILS(omnibus_lane_ahead(client, NULL, 1.0, &place, 1, &count), ARGUMENT, "position_m is NULL");
    FAILS(omnibus_create_camera(client, "x", 0, NULL, &bundle), ARGUMENT, "camera is NULL");
    FAILS(omnibus_latest(NULL, &measurement), ARGUMENT, "bundle is NULL");
    FAILS(omnibus_data(NULL, OMNIBUS_OUTPUT_COLOR, NULL), ARGUMENT, "data is NULL");
    OK(omnibus_control(client, NULL, 0));
    omnibus_close(NULL);
    omnibus_release(NULL);
    omnibus_destroy_bundle(NULL);

    /* Numbers and texts. */
    FAILS(omnibus_control(client, &control, 1), ARGUMENT, "throttle");
    control.throttle = 0.0f;
    control.flags = 1u << 31;
    FAILS(omnibus_control(client, &control, 1), ARGUMENT, "0x80000000 are unknown");
    FAILS(omnibus_control(client, &control, SIZE_MAX), ARGUMENT, "more than memory can hold");
    bad.rotation_xyzw[3] = 0.5f;
    FAILS(omnibus_spawn(client, "vehicle.audi.a2", &bad, 0, &id), ARGUMENT, "unit quaternion");
    FAILS(omnibus_spawn(client, "\xff", &ROOF, 0, &id), ARGUMENT, "utf-8");
    FAILS(omnibus_synchronise(client, -1.0), ARGUMENT, "delta_secs is -1");
    FAILS(omnibus_synchronise(client, INFINITY), ARGUMENT, "infinite");
    FAILS(omnibus_set_timeouts(client, NAN, 1.0), ARGUMENT, "frame_secs is NaN");
    FAILS(omnibus_lane_ahead(client, ROOF.position_m, 0.0, &place, 1, &count), ARGUMENT, "spacing_m");

    /* Ids, and what the simulator refuses. */
    FAILS(omnibus_actor(client, 9999, &actor), ARGUMENT, "actor 9999 does not exist");
    FAILS(omnibus_destroy(client, 9999), REFUSED, "9999");
    EXPECT(omnibus_last_refusal() == OMNIBUS_REFUSAL_UNKNOWN_ACTOR);
    FAILS(omnibus_spawn(client, "vehicle.no.such", &ROOF, 0, &id), REFUSED, "vehicle.no.such");
    EXPECT(omnibus_last_refusal() == OMNIBUS_REFUSAL_UNKNOWN_BLUEPRINT);
    OK(omnibus_actor(client, car, &actor));
    place = actor->pose;
    FAILS(omnibus_spawn(client, "vehicle.audi.a2", &place, 0, &id), REFUSED, "spawn");
    EXPECT(omnibus_last_refusal() == OMNIBUS_REFUSAL_SPAWN_COLLISION);
    OmnibusCamera camera = {.pose = ROOF, .width = 64, .height = 48, .fov_rad = 9.0f, .held_max = 1,
                            .outputs = OMNIBUS_OUTPUT_COLOR};
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), REFUSED, "fov_rad is 9");
    camera.lens = (OmnibusLens){.model = OMNIBUS_LENS_BROWN_CONRADY, .coefficients = {-9.0f}};
    camera.fov_rad = 1.5f;
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), REFUSED, "polynomial falls");
    camera.lens.model = 9;
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), ARGUMENT, "lens.model is 9");
    camera.lens = (OmnibusLens){.model = OMNIBUS_LENS_FISHEYE, .max_angle_rad = 1.6f};
    camera.fov_rad = 3.2f;
    OK(omnibus_create_camera(client, "round", car, &camera, &bundle));
    omnibus_destroy_bundle(bundle);
    camera.effects = (OmnibusEffects){.exposure = OMNIBUS_EXPOSURE_MANUAL, .bloom = 0.1f};
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), REFUSED, "iso is 0, not 1");
    camera.effects.exposure = 7;
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), ARGUMENT, "effects.exposure is 7");
    camera.effects.exposure = OMNIBUS_EXPOSURE_AUTOMATIC;
    OK(omnibus_create_camera(client, "bright", car, &camera, &bundle));
    omnibus_destroy_bundle(bundle);
    camera.held_max = OMNIBUS_HELD_MAX + 1;
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), ARGUMENT, "held_max is 8");
    camera.outputs = OMNIBUS_OUTPUT_POINTS;
    FAILS(omnibus_create_camera(client, "x", car, &camera, &bundle), ARGUMENT, "0x10");

    /* States, builds and names. */
    FAILS(omnibus_join_barrier(client), NOT_ALLOWED, "holds the tick");
    FAILS(omnibus_connect(OMNIBUS_INTERFACE + 1, "x", NULL, &other), BUILD, "compiled with interface");
    FAILS(omnibus_connect(OMNIBUS_INTERFACE, "x", "nowhere", &other), CONNECTION, "nowhere");
    EXPECT(strstr(omnibus_build(), "(build ") != NULL);
    OK(omnibus_tick(client, NULL));
}

/* Another thread's call, which waits for a frame that this thread never requests. */
static void *await_frame(void *client) {
    OmnibusStatus status;
    do {
        status = omnibus_await_frame(client, NULL);
    } while (status == OMNIBUS_STATUS_NOT_ALLOWED);
    return (void *)(uintptr_t)status;
}

static void killed(const OmnibusClient *client, const char *instance) {
    OmnibusStatus status;
    OmnibusClient *observer;
    OmnibusWorld world;
    pthread_t thread;
    void *waited;
    OmnibusCamera camera = {.pose = ROOF, .width = 64, .height = 48, .fov_rad = 1.5f, .held_max = 2,
                            .outputs = OMNIBUS_OUTPUT_COLOR};
    OmnibusBundle *eye;
    OmnibusMeasurement *image;
    OmnibusData color;
    uint32_t car = spawn(client);
    OK(omnibus_create_camera(client, "eye", car, &camera, &eye));
    OK(omnibus_tick(client, NULL));
    OK(omnibus_latest(eye, &image));
    OK(omnibus_data(image, OMNIBUS_OUTPUT_COLOR, &color));
    OK(omnibus_connect(OMNIBUS_INTERFACE, "observer", instance, &observer));
    EXPECT(pthread_create(&thread, NULL, await_frame, observer) == 0);
    /* One client is for one thread at a time. */
    while ((status = omnibus_refresh(observer, NULL)) == OMNIBUS_STATUS_OK) {
    }
    FAILS(status, NOT_ALLOWED, "another thread is inside a call");
    /* The test kills the simulator when it has read this line. */
    printf("ready\n");
    fflush(stdout);
    pthread_join(thread, &waited);
    EXPECT((OmnibusStatus)(uintptr_t)waited == OMNIBUS_STATUS_ENDED);
    while ((status = omnibus_tick(client, NULL)) == OMNIBUS_STATUS_OK) {
    }
    FAILS(status, ENDED, "the host has ended");
    /* What was taken in stays readable. */
    OK(omnibus_world(client, &world));
    EXPECT(world.actor_count >= 1 && world.actors[0].actor_id != 0);
    EXPECT(((const uint8_t *)color.bytes)[3] == 255);
    FAILS(omnibus_destroy(client, car), ENDED, "the host has ended");
    omnibus_close(observer);
    omnibus_destroy_bundle(eye);
    omnibus_release(image);
}

int main(int argc, char **argv) {
    EXPECT(argc == 3);
    OmnibusClient *client;
    OK(omnibus_connect(OMNIBUS_INTERFACE, "interface", argv[1], &client));
    OK(omnibus_set_timeouts(client, INFINITY, 60.0));
    OK(omnibus_synchronise(client, 0.05));
    if (strcmp(argv[2], "sensors") == 0) {
        sensors(client);
    } else if (strcmp(argv[2], "radar") == 0) {
        radar(client);
    } else if (strcmp(argv[2], "wrong") == 0) {
        wrong(client);
    } else {
        killed(client, argv[1]);
    }
    omnibus_close(client);
    return 0;
}
