/* The mechanization of ins_eval/strapdown.py in C, as one writes it down: damped vertical channel, every term in.
 *
 * LANES flights go through at once, one to a lane of a vector; LANES = 1 is plain scalar code. Arrays hold the lanes of
 * a number side by side: increments[n][3][LANES]. Results: rows of time, latitude, longitude, height, velocity,
 * quaternion, each LANES wide.
 */
#include <math.h>

#if LANES > 1
typedef double real __attribute__((vector_size(8 * LANES), aligned(8)));
static inline real lanewise(double (*f)(double), real x)
{
    for (int i = 0; i < LANES; i++)
        x[i] = f(x[i]);
    return x;
}
static inline real root(real x)
{
    for (int i = 0; i < LANES; i++)
        x[i] = __builtin_sqrt(x[i]);
    return x;
}
#define SIN(x) lanewise(sin, x)
#define COS(x) lanewise(cos, x)
#define ROOT(x) root(x)
#else
typedef double real;
#define SIN(x) sin(x)
#define COS(x) cos(x)
#define ROOT(x) sqrt(x)
#endif

typedef struct { real x, y, z; } vec;
typedef struct { real w, x, y, z; } quat;

static const double A = 6378137.0, F = 1.0 / 298.257223563, RATE = 7.292115e-5, GM = 3.986004418e14;
static const double G_EQUATOR = 9.7803253359, G_POLE = 9.8321849378;

static inline vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline vec add(vec a, real s, vec b) { return (vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; }
static inline vec plus(vec a, vec b) { return (vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline vec minus(vec a, vec b) { return (vec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline vec scaled(real s, vec a) { return (vec){s * a.x, s * a.y, s * a.z}; }
static inline real all(double s)
{
    real r = {0};
    return r + s;
}
static inline vec rotate(quat q, vec v)
{
    vec u = {q.x, q.y, q.z}, t = scaled(all(2.0), cross(u, v));
    return plus(add(v, q.w, t), cross(u, t));
}
static inline quat multiply(quat p, quat q)
{
    return (quat){p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                  p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}
static inline quat turned(vec v)
{
    real x = 0.25 * (v.x * v.x + v.y * v.y + v.z * v.z);
    real c = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)));
    real s = 0.5 * (1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0))));
    return (quat){c, s * v.x, s * v.y, s * v.z};
}

typedef struct { vec w, f; } twist;
typedef struct { quat rotation; vec gained, moment; } leg;

static inline twist bracket(twist a, twist b)
{
    return (twist){cross(b.w, a.w), minus(cross(b.w, a.f), cross(a.w, b.f))};
}
static inline twist combine(twist a, double s, twist b) { return (twist){add(a.w, all(s), b.w), add(a.f, all(s), b.f)}; }

/* value, slope or curvature (even or odd about the middle) of the middle two of six samples */
static inline vec fitted(const real *x, const double *weights, double parity)
{
    real m[3];
    for (int j = 0; j < 3; j++) {
        m[j] = all(0.0);
        for (int i = 0; i < 3; i++)
            m[j] += weights[i] * (x[3 * (3 + i) + j] + parity * x[3 * (2 - i) + j]);
    }
    return (vec){m[0], m[1], m[2]};
}

/* over the middle two of six samples of angle and of velocity; weights[3][3]: of the inner, the next, the outer pair */
static inline leg half(const real *angle, const real *velocity, const double *weights)
{
    twist a1 = {fitted(angle, weights, 1.0), fitted(velocity, weights, 1.0)};
    twist a2 = {fitted(angle, weights + 3, -1.0), fitted(velocity, weights + 3, -1.0)};
    twist a3 = {fitted(angle, weights + 6, 1.0), fitted(velocity, weights + 6, 1.0)};
    twist c1 = bracket(a1, a2), c2 = bracket(a1, combine(c1, 2.0, a3));
    twist o = bracket(combine(combine(c1, -20.0, a1), -1.0, a3), combine(a2, -1.0 / 60.0, c2));
    twist sum = combine(combine(a1, 1.0 / 12.0, a3), 1.0 / 240.0, o);
    vec r = sum.w;
    real x = r.x * r.x + r.y * r.y + r.z * r.z;
    real first = 0.5 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)));
    real second = 1.0 / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0)));
    vec across = cross(r, sum.f), moment = scaled(all(1.0 / 12.0), plus(a2.f, cross(a1.w, a1.f)));
    moment = add(moment, all(0.5), cross(a1.w, moment));
    return (leg){turned(r), add(add(sum.f, first, across), second, cross(r, across)), moment};
}

typedef struct { real north, east, sine, cosine, weight; } place;

static inline place at(real latitude, real height)
{
    const double e2 = F * (2.0 - F), b = A * (1.0 - F), m = RATE * RATE * A * A * b / GM;
    const double k = b * G_POLE / (A * G_EQUATOR) - 1.0;
    place p;
    p.sine = SIN(latitude), p.cosine = COS(latitude);
    real s2 = p.sine * p.sine, w = 1.0 - e2 * s2, normal = A / ROOT(w), meridian = normal * (1.0 - e2) / w;
    real h = height / A, surface = G_EQUATOR * (1.0 + k * s2) / ROOT(w);
    p.weight = surface * (1.0 - 2.0 * (1.0 + F + m - 2.0 * F * s2) * h + 3.0 * h * h);
    p.north = 1.0 / (meridian + height), p.east = 1.0 / ((normal + height) * p.cosine);
    return p;
}
static inline vec transport(place p, vec v)
{
    real rate = p.east * v.y;
    return (vec){rate * p.cosine, -p.north * v.x, -rate * p.sine};
}
typedef struct { vec frame, acceleration; } rates;
static inline rates moving(place p, vec v)
{
    vec earth = {RATE * p.cosine, all(0.0), -RATE * p.sine}, carried = transport(p, v);
    vec frame = plus(carried, earth), turning = plus(frame, earth), fall = cross(v, turning);
    return (rates){frame, {fall.x, fall.y, p.weight + fall.z}};
}

/* angle, velocity: n samples, with two more before the first and after the last; time, aid: n; start: latitude,
 * longitude, height, velocity, quaternion; rows: one for the start and one every `every` steps */
void navigate(long n, double t0, const double *time, const real *angle, const real *velocity, const real *aid,
              const double *start, const double *weights, const double *gains, long every, real *rows)
{
    real latitude = all(start[0]), longitude = all(start[1]), height = all(start[2]), offset = all(0.0), sum = all(0.0);
    vec v = {all(start[3]), all(start[4]), all(start[5])};
    quat q = {all(start[6]), all(start[7]), all(start[8]), all(start[9])};
    place p = at(latitude, height);
    rates e = moving(p, v);
    vec change = scaled(all(0.0), v), growth = change;
    for (long step = 0; step < n / 4; step++) {
        const real *w = angle + 12 * step, *f = velocity + 12 * step;
        double t1 = time[4 * step + 3], dt = t1 - t0;
        leg one = half(w, f, weights), two = half(w + 6, f + 6, weights);
        vec later = rotate(one.rotation, two.gained);
        vec gained = rotate(q, plus(one.gained, later));
        vec moment = plus(scaled(all(0.5), plus(one.moment, rotate(one.rotation, two.moment))),
                          scaled(all(0.25), minus(later, one.gained)));
        moment = rotate(q, moment);
        vec middle = add(scaled(all(0.5 * dt), v), all(dt / 6.0), change);
        p = at(latitude + p.north * middle.x, height - middle.z);
        vec lag = cross(e.frame, gained);
        change = add(add(gained, all(dt), e.acceleration), all(-0.5 * dt), lag);
        vec mean = add(minus(add(v, all(0.5), change), moment), all(dt / 12.0), lag);
        mean = add(mean, all(5.0 / 12.0 * dt), growth);
        vec before = e.acceleration, turn = transport(p, change);
        e = moving(p, mean);
        growth = minus(e.acceleration, before);
        vec first = add(scaled(all(0.5 * dt), gained), all(dt), moment);
        vec turns = cross(e.frame, add(first, all(-dt * dt / 6.0), lag));
        v = minus(add(plus(v, gained), all(dt), e.acceleration), turns);
        v = add(v, all(dt * dt / 12.0), cross(e.acceleration, turn));
        if (step > 0)
            offset = height - aid[4 * step - 1];
        sum += offset * dt;
        v.z += (gains[1] * offset + gains[2] * sum) * dt;
        height -= gains[0] * offset * dt;
        latitude += dt * p.north * mean.x;
        longitude += dt * p.east * mean.y;
        height -= dt * mean.z;
        q = multiply(turned(scaled(all(-dt), e.frame)), multiply(q, multiply(one.rotation, two.rotation)));
        real unit = 1.5 - 0.5 * (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
        q = (quat){unit * q.w, unit * q.x, unit * q.y, unit * q.z};
        t0 = t1;
        if ((step + 1) % every == 0) {
            real *row = rows + (step + 1) / every * 11;
            row[0] = all(t1), row[1] = latitude, row[2] = longitude, row[3] = height;
            row[4] = v.x, row[5] = v.y, row[6] = v.z;
            row[7] = q.w, row[8] = q.x, row[9] = q.y, row[10] = q.z;
        }
    }
}
