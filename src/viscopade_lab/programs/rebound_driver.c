#include <time.h>
#include "ice.c"

/* Speeds along the line of centres before and after a collision, radii and masses. */
struct bounce { double before, after, r1, r2, m1, m2; };
typedef enum REB_COLLISION_RESOLVE_OUTCOME resolve_function(struct reb_simulation *, struct reb_collision);
resolve_function *inner;
struct bounce *bounces;
size_t bounces_n, bounces_size;
double constant_eps = 1.0;

double constant(const struct reb_simulation *r, double v) { (void)r; (void)v; return constant_eps; }

static double closing(const struct reb_particle *a, const struct reb_particle *b, const double *n)
{
    return n[0] * (b->vx - a->vx) + n[1] * (b->vy - a->vy) + n[2] * (b->vz - a->vz);
}

enum REB_COLLISION_RESOLVE_OUTCOME logged(struct reb_simulation *r, struct reb_collision c)
{
    const struct reb_particle *a = r->particles + c.p1, *b = r->particles + c.p2;
    double n[3] = {a->x + c.gb.x - b->x, a->y + c.gb.y - b->y, a->z + c.gb.z - b->z};
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int i = 0; i < 3; i++) n[i] /= length;
    const int64_t number = r->collisions_log_n;
    const double before = closing(a, b, n);
    const enum REB_COLLISION_RESOLVE_OUTCOME outcome = inner(r, c);
    if (r->collisions_log_n > number && bounces_n < bounces_size)
        bounces[bounces_n++] = (struct bounce){before, -closing(a, b, n), a->r, b->r, a->m, b->m};
    return outcome;
}

static int64_t now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

int64_t spent, calls;

enum REB_COLLISION_RESOLVE_OUTCOME timed(struct reb_simulation *r, struct reb_collision c)
{
    const int64_t begin = now();
    const enum REB_COLLISION_RESOLVE_OUTCOME outcome = inner(r, c);
    spent += now() - begin;
    calls++;
    return outcome;
}

/* Nanoseconds between two looks at the clock. */
double of_clock(int n)
{
    int64_t total = 0;
    for (int i = 0; i < n; i++) {
        const int64_t begin = now();
        total += now() - begin;
    }
    return (double)total / n;
}
