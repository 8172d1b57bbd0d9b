/*
 * The agent of `bench latency` in C: ticks, reads the snapshot and answers with a control.
 *
 * Usage: loop_agent INSTANCE ACTOR. It prints "ready". For each line "loop COUNT" on standard input it
 * prints COUNT lines: the frame, and when it was read, in nanoseconds of the monotonic clock.
 */

#include <omnibus.h>
#include <stdio.h>
#include <stdlib.h>

#define COUNT_MAX 64

static void check(OmnibusStatus status) {
    if (status != OMNIBUS_STATUS_OK) {
        fprintf(stderr, "loop_agent: %s\n", omnibus_last_error());
        exit(1);
    }
}

int main(int argc, char **argv) {
    OmnibusClient *client;
    const OmnibusActor *actor;
    uint64_t frames[COUNT_MAX], nanos[COUNT_MAX];
    uint32_t turns = 0;
    int count;

    if (argc != 3) {
        fprintf(stderr, "usage: loop_agent INSTANCE ACTOR\n");
        return 2;
    }
    OmnibusControl control = {.actor_id = (uint32_t)strtoul(argv[2], NULL, 10), .brake = 1.0f};
    check(omnibus_connect(OMNIBUS_INTERFACE, "agent", argv[1], &client));
    check(omnibus_synchronise(client, 0.05));
    puts("ready");
    fflush(stdout);
    while (scanf(" loop %d", &count) == 1 && count <= COUNT_MAX) {
        for (int turn = 0; turn < count; turn++) {
            /* Each answer differs from the one before. */
            control.steer = (float)(++turns % 512) / 1024.0f;
            check(omnibus_control(client, &control, 1));
            check(omnibus_tick(client, &frames[turn]));
            check(omnibus_actor(client, control.actor_id, &actor));
            float position_m = actor->pose.position_m[0], steer = actor->steer;
            nanos[turn] = omnibus_clock_nanos();
            if (position_m != position_m || steer != control.steer) {
                fprintf(stderr, "loop_agent: frame %llu shows steer %g, not %g\n",
                        (unsigned long long)frames[turn], steer, control.steer);
                return 1;
            }
        }
        for (int turn = 0; turn < count; turn++) {
            printf("%llu %llu\n", (unsigned long long)frames[turn], (unsigned long long)nanos[turn]);
        }
        fflush(stdout);
    }
    omnibus_close(client);
    return 0;
}
