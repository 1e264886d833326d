// Camera, lights and the shading formula (the reference's section on materials), in double.
#include "tests/oracle/oracle.h"

#include <math.h>
#include <string.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double normalise(double v[3])
{
    double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++) v[i] /= length;
    return length;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    double r[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, r, sizeof r);
}

OracleRay oracle_camera_ray(const Oracle *oracle, double x, double y, double width, double height)
{
    const double *c = oracle->camera;
    double forward[3], right[3], up[3];
    for (int i = 0; i < 3; i++) forward[i] = c[3 + i] - c[i];
    normalise(forward);
    cross(forward, c + 6, right);
    normalise(right);
    cross(right, forward, up);
    double half = oracle->orthographic ? c[10] / 2 : tan(c[9] / 2);
    double sx = (2 * x / width - 1) * half * width / height, sy = (1 - 2 * y / height) * half;
    OracleRay ray = {.near = 0, .far = ORACLE_INFINITY};
    for (int i = 0; i < 3; i++) {
        double aside = sx * right[i] + sy * up[i];
        ray.origin[i] = c[i] + (oracle->orthographic ? aside : 0);
        ray.direction[i] = forward[i] + (oracle->orthographic ? 0 : aside);
    }
    normalise(ray.direction);
    return ray;
}

bool oracle_light_ray(const Oracle *oracle, const OracleLight *light, const double point[3], const double normal[3],
                      double bias, OracleRay *ray)
{
    ray->near = 0;
    ray->far = ORACLE_INFINITY;
    for (int i = 0; i < 3; i++) {
        ray->origin[i] = point[i] + bias * normal[i];
        ray->direction[i] = light->kind == LIGHT_DIRECTIONAL ? -light->v[i] : light->v[3 + i] - point[i];
    }
    double distance = normalise(ray->direction);
    if (light->kind != LIGHT_DIRECTIONAL) ray->far = distance;
    return dot(ray->direction, normal) > 0;
}

double oracle_light_part(const OracleLight *light, const double point[3])
{
    if (light->kind == LIGHT_DIRECTIONAL) return 1;
    double way[3], axis[3];
    for (int i = 0; i < 3; i++) {
        way[i] = point[i] - light->v[3 + i];
        axis[i] = light->v[i];
    }
    double distance = normalise(way), fade = light->v[12] > 0 ? distance / light->v[12] : 0,
           part = 1 / (1 + fade * fade);
    if (light->kind != LIGHT_SPOT) return part;
    normalise(axis);
    double c = dot(way, axis), full = cos(fmin(light->v[9] / 2, acos(-1.0))),
           rim = cos(fmin(light->v[9] / 2 + light->v[10], acos(-1.0)));
    double s = c <= rim ? 0 : c >= full ? 1 : (c - rim) / (full - rim);
    return part * s * s * (3 - 2 * s);
}

void oracle_shade(Oracle *oracle, const OracleRay *ray, const OracleHit *hit, int samples, double bias, double color[3])
{
    const double *m = oracle->leaves[hit->leaf].material;
    double normal[3];
    memcpy(normal, hit->normal, sizeof normal);
    for (int i = 0; i < 3; i++) color[i] = m[i] * m[3];
    for (uint32_t k = 0; k < oracle->light_count; k++) {
        const OracleLight *light = &oracle->lights[k];
        OracleRay to_light;
        if (!oracle_light_ray(oracle, light, hit->point, normal, bias, &to_light)) continue;
        bool shadow = light->v[13] != 0;
        if (shadow &&
            (samples ? oracle_reference_blocked(oracle, &to_light, samples) : oracle_blocked(oracle, &to_light)))
            continue;
        double lit = dot(normal, to_light.direction), mirrored = 0;
        for (int i = 0; i < 3; i++) mirrored -= (2 * lit * normal[i] - to_light.direction[i]) * ray->direction[i];
        double part = oracle_light_part(light, hit->point);
        double shine = mirrored > 0 ? m[5] * pow(mirrored, m[6]) : 0;
        for (int i = 0; i < 3; i++) color[i] += part * (m[i] * m[4] * lit + shine) * light->v[6 + i];
    }
}

void oracle_render(Oracle *oracle, int width, int height, int stride, int samples, double bias, float *rgb)
{
    for (int y = stride / 2; y < height; y += stride) {
        for (int x = stride / 2; x < width; x += stride) {
            OracleRay ray = oracle_camera_ray(oracle, x + 0.5, y + 0.5, width, height);
            OracleHit hit;
            double color[3];
            memcpy(color, oracle->background, sizeof color);
            if (samples ? oracle_reference_hit(oracle, &ray, samples, &hit) : oracle_hit(oracle, &ray, &hit)) {
                oracle_shade(oracle, &ray, &hit, samples, bias, color);
            }
            for (int i = 0; i < 3; i++) *rgb++ = (float)color[i];
        }
    }
}
