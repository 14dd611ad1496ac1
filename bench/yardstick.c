/* The yardstick: the bare algorithm of an impact in a sphere, 256 lanes, no particle ever loaded or retired, no count,
 * no impulse, no energy correction. gcc -O3 -march=native vectorises both loops. argv: passes. Prints ns per impact. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define LANES 256
#define PAD 8

static double x[LANES + PAD], y[LANES + PAD], z[LANES + PAD], u[LANES + PAD], v[LANES + PAD], w[LANES + PAD];

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int argc, char **argv)
{
    const int passes = argc > 1 ? atoi(argv[1]) : 40000;
    const double radius2 = 0.25, twice_over_radius2 = 2.0 / radius2;
    for (int i = 0; i < LANES; i++) {
        x[i] = 0.2 * (drand48() - 0.5), y[i] = 0.2 * (drand48() - 0.5), z[i] = 0.2 * (drand48() - 0.5);
        u[i] = drand48() - 0.5, v[i] = drand48() - 0.5, w[i] = drand48() - 0.5;
    }
    for (int repeat = 0; repeat < 7; repeat++) {
        const double start = now();
        for (int pass = 0; pass < passes; pass++) {
            for (int i = 0; i < LANES; i++) {
                const double c = x[i] * x[i] + y[i] * y[i] + z[i] * z[i] - radius2;
                const double b = x[i] * u[i] + y[i] * v[i] + z[i] * w[i];
                const double a = u[i] * u[i] + v[i] * v[i] + w[i] * w[i];
                const double d = b * b - a * c, root = sqrt(d > 0.0 ? d : 0.0);
                const double t = (b > 0.0 ? -c : root - b) / (b > 0.0 ? b + root : a);
                x[i] += t * u[i], y[i] += t * v[i], z[i] += t * w[i];
            }
            for (int i = 0; i < LANES; i++) {
                const double n = (x[i] * u[i] + y[i] * v[i] + z[i] * w[i]) * twice_over_radius2;
                u[i] -= n * x[i], v[i] -= n * y[i], w[i] -= n * z[i];
            }
        }
        printf("%.4f\n", (now() - start) / passes / LANES * 1e9);
    }
    return x[0] > 1.0; /* the result is used */
}
