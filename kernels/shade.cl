// Normals and shading.

// What differs by leaf is done for the lanes of one leaf at a time, since a packet seldom has more than two: the highest rank in lanes still to do. Where
// there is but one leaf nothing need be looked for (3 % of a frame of S1).
INLINE uint next_rank(UINT ranks, INT todo, uint leaf_count)
{
    UINT zero = 0;
    return leaf_count == 1 ? 0 : highest_uint(todo ? ranks : zero);
}

typedef struct Vector {
    FLOAT x, y, z;
} Vector;

// The normal where the ray meets the leaf of that rank at w, towards the viewer, in the primary view's axes.
INLINE Vector surface_normal(const Ray *ray, uint leaf_count, UINT ranks, INT hits, FLOAT w)
{
    Vector n;
    n.x = n.y = n.z = 0.0f;
    INT todo = hits;
    while (ANY(todo)) {
        uint rank = next_rank(ranks, todo, leaf_count);
        INT mine = todo & (ranks == rank);
        todo = todo & !mine;
        uint leaf = ray->nodes[rank].leaf;
        Slope slope;
#ifdef HAS_FIELD
        if (ray->nodes[leaf].count == NODE_FIELD) {
            slope = field_slope(ray, leaf, w, mine);
        } else
#endif
#if defined(HAS_FREEFORM) || defined(HAS_SHEET) || defined(HAS_THICK)
        if (ray->nodes[leaf].count) {
            uint begin = list_until(ray, 0, ray->count, leaf + 1u);
            uint stop = list_until(ray, begin, ray->count, ray->nodes[leaf].end);
            uint marks = ray->nodes[leaf].count;
#ifdef HAS_SHEET
            if (marks & NODE_SHEET) slope = sheet_slope(ray, begin, stop, mine, w);
#endif
#ifdef HAS_THICK
            if (marks & NODE_THICK) slope = thick_slope(ray, leaf, begin, stop, mine, w);
#endif
#ifdef HAS_LIFTED
            if (marks & NODE_LIFTED) slope = lifted_slope(ray, leaf, begin, stop, w);
#endif
#ifdef HAS_FREEFORM
            if (!(marks & (NODE_SHEET | NODE_THICK | NODE_LIFTED))) slope = freeform_slope(ray, leaf, begin, stop, w);
#endif
        } else
#endif
            slope = record_slope(ray->records + leaf, ray->u, ray->v, w);
        n.x = mine ? slope.u : n.x;
        n.y = mine ? slope.v : n.y;
        n.z = mine ? slope.w : n.z;
    }
    // From screen coordinates: the gradient is (r, s, f) times these, up to a factor.
    float kappa = ray->kappa;
    FLOAT p = 1.0f - kappa * w;
    n.z = p * n.z - kappa * (ray->u * n.x + ray->v * n.y);
    FLOAT towards = kappa * (ray->u * n.x + ray->v * n.y) + n.z;
    FLOAT scale = inverse_root(most(n.x * n.x + n.y * n.y + n.z * n.z, 1e-36f));
    scale = towards > 0.0f ? -scale : scale;
    n.x *= scale;
    n.y *= scale;
    n.z *= scale;
    return n;
}

static FLOAT power(FLOAT base, float exponent)
{
    // log2 of a vector costs about four times as much as exp2, and pow seven times as much as log2.
    return base2_power(exponent * base2_logarithm(most(base, 1e-30f)));
}

#ifdef INTEGER_SHININESS
// By multiplication: exp2 and log2 would take a third of the time of the shading.
static FLOAT integer_power(FLOAT base, uint exponent)
{
    FLOAT result = 1.0f;
    for (; exponent; exponent >>= 1) {
        if (exponent & 1u) result *= base;
        base *= base;
    }
    return result;
}
#endif

static FLOAT highlight(FLOAT rv, float shininess)
{
#ifdef INTEGER_SHININESS
    if (shininess == floor(shininess) && shininess <= 1024.0f) return integer_power(rv, (uint)shininess);
#endif
    return power(rv, shininess);
}

// The share of a point light's or a spot's light that comes from the direction l, over a distance whose square is given.
INLINE FLOAT light_strength(__global const LightConstants *light, Vector l, FLOAT square)
{
    FLOAT c = -(light->axis[0] * l.x + light->axis[1] * l.y + light->axis[2] * l.z);
    FLOAT s = least(most((c - light->rim) * light->rise, 0.0f), 1.0f);
    return s * s * (3.0f - 2.0f * s) / (1.0f + light->fade * square);
}

// The colour that the material of some lanes gives: color (ambient + emission), with the first lights, and for each light that is visible,
// color diffuse (n l) + specular (r v)^shininess, per light colour.
static void shade_material(__global const MaterialConstants *m, __global const LightConstants *lights, uint light_count,
                           Vector p, Vector n, Vector v, UINT visible, INT mine, int first, Vector *color)
{
    float ambient = first ? m->ambient + m->emission : 0.0f;
    Vector c;
    c.x = m->color[0] * ambient;
    c.y = m->color[1] * ambient;
    c.z = m->color[2] * ambient;
    FLOAT nv = n.x * v.x + n.y * v.y + n.z * v.z;
    for (uint k = 0; k < light_count; k++) {
        __global const LightConstants *light = lights + k;
        INT lit = mine & ((visible & (1u << k)) != 0);
        if (!ANY(lit)) continue;
        Vector l;
        l.x = light->at[0];
        l.y = light->at[1];
        l.z = light->at[2];
        FLOAT square = 1.0f;
        if (light->point) {
            l.x -= p.x;
            l.y -= p.y;
            l.z -= p.z;
            square = l.x * l.x + l.y * l.y + l.z * l.z;
            FLOAT scale = inverse_root(square);
            l.x *= scale;
            l.y *= scale;
            l.z *= scale;
        }
        FLOAT nl = n.x * l.x + n.y * l.y + n.z * l.z;
        FLOAT strength = light->point ? light_strength(light, l, square) : (FLOAT)(1.0f);
        FLOAT rv = most(2.0f * nl * nv - (l.x * v.x + l.y * v.y + l.z * v.z), 0.0f);
        // Few packets have a highlight: 5 % of a frame of S1.
        FLOAT shine = 0.0f;
        if (ANY(lit & (rv > m->dull))) shine = highlight(rv, m->shininess);
        FLOAT zero = 0.0f;
        FLOAT diffuse = lit ? strength * m->diffuse * most(nl, 0.0f) : zero;
        shine = (lit & (nl > 0.0f)) ? strength * m->specular * shine : zero; // also where nothing asked for shadows
        c.x += light->color[0] * (m->color[0] * diffuse + shine);
        c.y += light->color[1] * (m->color[1] * diffuse + shine);
        c.z += light->color[2] * (m->color[2] * diffuse + shine);
    }
    color->x = mine ? c.x : color->x;
    color->y = mine ? c.y : color->y;
    color->z = mine ? c.z : color->z;
}
