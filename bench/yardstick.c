/* The machine's own pace. argv: what, passes. Prints seven times nanoseconds an item; an item is
 *   impact   one impact in a sphere: the bare algorithm, 256 lanes, no particle ever loaded or retired, no count, no
 *            impulse, no energy correction
 *   lane     the same with all that a lane of the engine knows: the end of the frame, short flights, counts, impulses and
 *            energy; still no particle is ever loaded or retired
 *   verlet   one step of velocity Verlet with a penalty wall, 256 lanes
 *   divide   one division of doubles, 256 lanes that do not wait for one another
 *   root     one square root, the same
 *   copy     one double from one end of the memory to another, 2 x 64 MB
 * gcc -O3 -march=native vectorises every inner loop. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define LANES 256
#define PAD 8
#define COPIED (1 << 23)
#define REPEATS 7

static double x[LANES + PAD], y[LANES + PAD], z[LANES + PAD], u[LANES + PAD], v[LANES + PAD], w[LANES + PAD];
static double *from, *to;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static double left[LANES + PAD], energy[LANES + PAD], half_inverse[LANES + PAD], shortest[LANES + PAD];
static double hits[LANES + PAD], impulse[LANES + PAD], wall[LANES + PAD];
static int some_hard, some_arrived;

static inline double hit(int i, double radius2)
{
    const double c = x[i] * x[i] + y[i] * y[i] + z[i] * z[i] - radius2;
    const double b = x[i] * u[i] + y[i] * v[i] + z[i] * w[i];
    const double a = u[i] * u[i] + v[i] * v[i] + w[i] * w[i];
    const double d = b * b - a * c, root = sqrt(d > 0.0 ? d : 0.0);
    const double t = (b > 0.0 ? -c : root - b) / (b > 0.0 ? b + root : a);
    return t > 0.0 ? t : 0.0;
}

static void impact(void)
{
    const double radius2 = 0.25, twice_over_radius2 = 2.0 / radius2;
    for (int i = 0; i < LANES; i++) {
        const double t = hit(i, radius2);
        x[i] += t * u[i], y[i] += t * v[i], z[i] += t * w[i];
    }
    for (int i = 0; i < LANES; i++) {
        const double n = (x[i] * u[i] + y[i] * v[i] + z[i] * w[i]) * twice_over_radius2;
        u[i] -= n * x[i], v[i] -= n * y[i], w[i] -= n * z[i];
    }
}

static void lane(void)
{
    const double radius2 = 0.25, over_radius = 2.0;
    for (int i = 0; i < LANES; i++) {
        const double when = hit(i, radius2), t = when < left[i] ? when : left[i];
        const int is_hit = when <= left[i], is_short = is_hit & (when < shortest[i]) & (hits[i] > 0.0);
        x[i] += t * u[i], y[i] += t * v[i], z[i] += t * w[i];
        left[i] -= t;
        wall[i] = is_short ? -2.0 : is_hit ? 0.0 : -1.0;
    }
    int hard = 0, arrived = 0;
    for (int i = 0; i < LANES; i++) {
        const int bounces = wall[i] >= 0.0;
        const double nx = x[i] * over_radius, ny = y[i] * over_radius, nz = z[i] * over_radius;
        const double b = u[i] * nx + v[i] * ny + w[i] * nz, given = 2.0 * (b > 0.0 ? b : 0.0);
        const double wx = u[i] - given * nx, wy = v[i] - given * ny, wz = w[i] - given * nz;
        const double f = 1.0 + (energy[i] - (wx * wx + wy * wy + wz * wz)) * half_inverse[i];
        u[i] = bounces ? wx * f : u[i], v[i] = bounces ? wy * f : v[i], w[i] = bounces ? wz * f : w[i];
        hits[i] += bounces ? 1.0 : 0.0;
        impulse[i] += bounces ? given : 0.0;
        hard |= wall[i] <= -2.0;
        arrived |= !(left[i] > 0.0);
    }
    some_hard |= hard, some_arrived |= arrived;
}

static void verlet(void)
{
    const double dt = 1e-3, alpha = 1e4, radius = 0.5;
    for (int i = 0; i < LANES; i++) {
        /* Kick and drift: the two half kicks between drifts are one. */
        const double r = sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
        const double kick = r > radius ? -alpha * dt * (r - radius) / r : 0.0;
        u[i] += kick * x[i], v[i] += kick * y[i], w[i] += kick * z[i];
        x[i] += dt * u[i], y[i] += dt * v[i], z[i] += dt * w[i];
    }
}

static void divide(void)
{
    for (int i = 0; i < LANES; i++)
        x[i] = u[i] / x[i];
}

static void root(void)
{
    for (int i = 0; i < LANES; i++)
        x[i] = sqrt(x[i] + u[i]);
}

static void copy(void)
{
    memcpy(to, from, COPIED * sizeof *to);
}

static const struct {
    const char *name;
    void (*pass)(void);
    double items;
} yardsticks[] = {
    {"impact", impact, LANES}, {"lane", lane, LANES},   {"verlet", verlet, LANES},
    {"divide", divide, LANES}, {"root", root, LANES},   {"copy", copy, COPIED},
};

int main(int argc, char **argv)
{
    const int passes = argc > 2 ? atoi(argv[2]) : 1;
    for (int i = 0; i < LANES; i++) {
        x[i] = 0.2 * (drand48() - 0.5), y[i] = 0.2 * (drand48() - 0.5), z[i] = 0.2 * (drand48() - 0.5);
        u[i] = drand48() - 0.5, v[i] = drand48() - 0.5, w[i] = drand48() - 0.5;
        energy[i] = u[i] * u[i] + v[i] * v[i] + w[i] * w[i], half_inverse[i] = 0.5 / energy[i];
        left[i] = 1e9, shortest[i] = 1e-9;
    }
    for (size_t k = 0; k < sizeof yardsticks / sizeof *yardsticks; k++) {
        if (argc < 2 || strcmp(argv[1], yardsticks[k].name) != 0)
            continue;
        if (yardsticks[k].pass == copy) {
            from = malloc(COPIED * sizeof *from), to = malloc(COPIED * sizeof *to);
            memset(to, 0, COPIED * sizeof *to), memset(from, 1, COPIED * sizeof *from);
        }
        if (yardsticks[k].pass == root)
            for (int i = 0; i < LANES; i++)
                x[i] = 1.0 + fabs(x[i]), u[i] = 1.0 + fabs(u[i]);
        for (int repeat = 0; repeat < REPEATS; repeat++) {
            const double start = now();
            for (int pass = 0; pass < passes; pass++)
                yardsticks[k].pass();
            printf("%.5f\n", (now() - start) / passes / yardsticks[k].items * 1e9);
        }
    }
    return x[0] > 1e9 || some_hard > some_arrived + 1 || (to && to[COPIED / 2] > 1e300); /* the results are used */
}
