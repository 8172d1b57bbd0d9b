/*
 * Two clients in lockstep: one advances the world, the other drives a car along its lane, and each
 * tick waits for it.
 *
 *     omnibus run --synchronous
 *     cargo build --release -p omnibus-c
 *     cc -std=c11 -pthread -Iclient-lib/c/include client-lib/c/examples/lockstep_agent.c \
 *         -Ltarget/release -lomnibus -lm -Wl,-rpath,"$PWD/target/release" -o lockstep_agent
 *     ./lockstep_agent
 *
 * The agent steers towards a point ahead on the lane (pure pursuit: R. C. Coulter,
 * CMU-RI-TR-92-01, 1992) and holds a speed. It looks neither at lights nor at others.
 */

#include <math.h>
#include <omnibus.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#define TICKS 200
#define DELTA_SECS 0.05
#define CRUISE_MPS 8.0f
/* Axle to axle, of the car below. */
#define WHEELBASE_M 2.875f
/* How far `steer` 1 turns the front wheels. */
#define STEER_MAX_RAD 0.61f
/* The point that the car is steered to lies so far ahead. */
#define AHEAD_M 7

/* Ends the program with the text of a failure. */
static void check(OmnibusStatus status) {
    if (status != OMNIBUS_STATUS_OK) {
        fprintf(stderr, "lockstep_agent: %s\n", omnibus_last_error());
        exit(1);
    }
}

/* A point of world space in the space of a pose: the rotation's inverse, x, y only. */
static void to_local(const OmnibusPose *pose, const float point[3], float local[2]) {
    float x = pose->rotation_xyzw[0], y = pose->rotation_xyzw[1];
    float z = pose->rotation_xyzw[2], w = pose->rotation_xyzw[3];
    float d[3];
    for (int i = 0; i < 3; i++) {
        d[i] = point[i] - pose->position_m[i];
    }
    local[0] = (1 - 2 * (y * y + z * z)) * d[0] + 2 * (x * y + w * z) * d[1] + 2 * (x * z - w * y) * d[2];
    local[1] = 2 * (x * y - w * z) * d[0] + (1 - 2 * (x * x + z * z)) * d[1] + 2 * (y * z + w * x) * d[2];
}

static float clamp(float value, float low, float high) {
    return fminf(fmaxf(value, low), high);
}

struct Agent {
    OmnibusClient *client;
    uint32_t car;
    float deviation_max_m;
};

/* Looks at the world and answers, once. */
static void drive(struct Agent *agent) {
    const OmnibusActor *car;
    OmnibusPose lane[AHEAD_M + 1];
    size_t count;
    float abeam[2], goal[2];
    check(omnibus_actor(agent->client, agent->car, &car));
    check(omnibus_lane_ahead(agent->client, car->pose.position_m, 1.0, lane, AHEAD_M + 1, &count));
    OmnibusControl control = {.actor_id = agent->car, .brake = 1.0f};
    if (count > 1) {
        const float *v = car->velocity_mps;
        float speed_mps = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        to_local(&car->pose, lane[0].position_m, abeam);
        agent->deviation_max_m = fmaxf(agent->deviation_max_m, fabsf(abeam[1]));
        /* Seen from the rear axle: the circle through both points has this curvature. */
        to_local(&car->pose, lane[count - 1].position_m, goal);
        goal[0] += WHEELBASE_M / 2;
        float curvature_per_m = 2 * goal[1] / fmaxf(goal[0] * goal[0] + goal[1] * goal[1], 1.0f);
        float missing_mps = CRUISE_MPS - speed_mps;
        control.steer = clamp(atanf(WHEELBASE_M * curvature_per_m) / STEER_MAX_RAD, -1, 1);
        control.throttle = clamp(0.15f + 0.2f * missing_mps, 0, 0.8f);
        control.brake = clamp(-0.2f * missing_mps - 0.1f, 0, 1);
    }
    check(omnibus_control(agent->client, &control, 1));
}

static void *run_agent(void *data) {
    struct Agent *agent = data;
    for (int tick = 0; tick < TICKS; tick++) {
        check(omnibus_await_frame(agent->client, NULL));
        drive(agent);
        check(omnibus_arrive(agent->client));
    }
    check(omnibus_leave_barrier(agent->client));
    return NULL;
}

int main(int argc, char **argv) {
    const char *instance = argc > 1 ? argv[1] : NULL;
    OmnibusClient *ticker;
    OmnibusPose place;
    size_t places;
    struct Agent agent = {0};
    pthread_t thread;

    check(omnibus_connect(OMNIBUS_INTERFACE, "ticker", instance, &ticker));
    check(omnibus_synchronise(ticker, DELTA_SECS));
    check(omnibus_spawn_points(ticker, &place, 1, &places));
    if (places == 0) {
        fprintf(stderr, "lockstep_agent: this map has no place for a car\n");
        return 1;
    }
    check(omnibus_spawn(ticker, "vehicle.tesla.model3", &place, 0, &agent.car));
    check(omnibus_tick(ticker, NULL));

    check(omnibus_connect(OMNIBUS_INTERFACE, "agent", instance, &agent.client));
    check(omnibus_join_barrier(agent.client));
    if (pthread_create(&thread, NULL, run_agent, &agent) != 0) {
        fprintf(stderr, "lockstep_agent: no thread can be started\n");
        return 1;
    }
    for (int tick = 0; tick < TICKS; tick++) {
        /* Returns when the agent has arrived at this frame. */
        check(omnibus_tick(ticker, NULL));
    }
    pthread_join(thread, NULL);

    const OmnibusActor *car;
    check(omnibus_actor(ticker, agent.car, &car));
    const float *at = car->pose.position_m;
    printf("drove %.1f m in %.1f s, at most %.2f m beside the lane's centre\n",
           hypotf(at[0] - place.position_m[0], at[1] - place.position_m[1]), TICKS * DELTA_SECS,
           agent.deviation_max_m);
    omnibus_close(agent.client);
    check(omnibus_destroy(ticker, agent.car));
    omnibus_close(ticker);
    return 0;
}
