// A part of shade.cl, for CPUs: vertices on diffuse surfaces are seen to sixteen at a time.
#ifndef RP_SHADE_GATHERED_CL
#define RP_SHADE_GATHERED_CL

#define RP_FETCHED_AHEAD 12u  // entries of the queue: some hundred nanoseconds

// Vertices on diffuse surfaces that wait for their number to come to sixteen.
typedef struct rp_gathered {
    uint count;
    uint slot[16], status[16], normal[2][16], path[4][16];  // geometric, shading; pixel, sample, depth, refraction
    float radiance[3][16], vertex[13][16];                  // direction, throughput, position, reflectance, offset
#ifdef RP_SKY_PAGED
    float sky[3][16];
#endif
} rp_gathered;

static inline void rp_gather(rp_gathered* g, const rp_reached_vertex* reached) {
    const rp_vertex_1* v = &reached->vertex;
    const uint k = g->count++;
    g->slot[k] = reached->slot;
    g->status[k] = reached->status;
    g->normal[0][k] = v->geometric_normal;
    g->normal[1][k] = v->shading_normal;
    g->path[0][k] = v->pixel;
    g->path[1][k] = v->sample;
    g->path[2][k] = v->depth;
    g->path[3][k] = (uint)v->refraction;
    g->radiance[0][k] = reached->radiance.x;
    g->radiance[1][k] = reached->radiance.y;
    g->radiance[2][k] = reached->radiance.z;
    const rp_vector_1 of[4] = {v->direction, v->throughput, v->position, v->reflectance};
    for (uint i = 0u; i < 4u; i++) {
        g->vertex[3u * i][k] = of[i].x;
        g->vertex[3u * i + 1u][k] = of[i].y;
        g->vertex[3u * i + 2u][k] = of[i].z;
    }
    g->vertex[12][k] = v->offset;
#ifdef RP_SKY_PAGED
    g->sky[0][k] = v->sky.x;
    g->sky[1][k] = v->sky.y;
    g->sky[2][k] = v->sky.z;
#endif
}

static inline rp_vector_16 rp_load_vector(float (*rows)[16]) {
    const rp_vector_16 v = {vload16(0, rows[0]), vload16(0, rows[1]), vload16(0, rows[2])};
    return v;
}
static inline void rp_store_vector(rp_vector_16 v, float (*rows)[16]) {
    vstore16(v.x, 0, rows[0]);
    vstore16(v.y, 0, rows[1]);
    vstore16(v.z, 0, rows[2]);
}
static inline rp_vector_1 rp_of_lane(float (*rows)[16], uint k) {
    const rp_vector_1 v = {rows[0][k], rows[1][k], rows[2][k]};
    return v;
}

static inline void rp_shade_gathered(__constant rp_render_params* params, const __global rp_light* lights, const __global uint* light_steps,
                                     rp_gathered* g, const rp_paths* paths, __global uint* film, uint* mine) {
    rp_vertex_16 vertex;
    vertex.direction = rp_load_vector(g->vertex);
    vertex.throughput = rp_load_vector(g->vertex + 3);
    vertex.position = rp_load_vector(g->vertex + 6);
    vertex.reflectance = rp_load_vector(g->vertex + 9);
    vertex.offset = vload16(0, g->vertex[12]);
    vertex.geometric_normal = vload16(0, g->normal[0]);
    vertex.shading_normal = vload16(0, g->normal[1]);
    vertex.pixel = vload16(0, g->path[0]);
    vertex.sample = vload16(0, g->path[1]);
    vertex.depth = vload16(0, g->path[2]);
    vertex.refraction = as_int16(vload16(0, g->path[3]));
#ifdef RP_SKY_PAGED
    vertex.sky = rp_load_vector(g->sky);
#endif
    rp_departure_16 all;
    rp_scatter_diffuse_16(params, lights, light_steps, &vertex, &all);
    float rows[17][16];  // start, light direction, light, direction, throughput, reach, density
    int shadow[16], go_on[16];
    rp_store_vector(all.start, rows);
    rp_store_vector(all.light_direction, rows + 3);
    rp_store_vector(all.light, rows + 6);
    rp_store_vector(all.direction, rows + 9);
    rp_store_vector(all.throughput, rows + 12);
    vstore16(all.light_reach, 0, rows[15]);
    vstore16(all.density, 0, rows[16]);
    vstore16(all.shadow, 0, shadow);
    vstore16(all.go_on, 0, go_on);
    for (uint k = 0u; k < g->count; k++) {
        rp_departure_1 out;
        out.start = rp_of_lane(rows, k);
        out.light_direction = rp_of_lane(rows + 3, k);
        out.light = rp_of_lane(rows + 6, k);
        out.direction = rp_of_lane(rows + 9, k);
        out.throughput = rp_of_lane(rows + 12, k);
        out.light_reach = rows[15][k];
        out.density = rows[16][k];
        out.shadow = shadow[k];
        out.go_on = go_on[k];
        out.refraction = (int)g->path[3][k];
        const float3 radiance = (float3)(g->radiance[0][k], g->radiance[1][k], g->radiance[2][k]);
        if (rp_depart(paths, g->slot[k], g->status[k], radiance, g->path[0][k], g->path[1][k], g->path[2][k], &out, mine) == RP_OUTCOME_ENDS)
            rp_end_path(params, paths, g->slot[k], film, g->path[0][k], radiance);
    }
    g->count = 0u;
}

// What one of `step` work-items does, whose number is `item`.
static RP_NOINLINE void rp_shade_runs(RP_SHADE_GEOMETRY uint item, uint step, uint count, __constant rp_render_params* restrict params,
                                      const __global rp_material* restrict materials, const __global rp_light* restrict lights,
                                      const __global uint* restrict light_steps, const __global rp_primitive_range* restrict ranges,
                                      rp_shade_queue queue, rp_paths all_paths, __global uint* restrict film, uint* mine) {
    const rp_paths* const paths = &all_paths;
    rp_reached_vertex reached;
    rp_gathered gathered;
    gathered.count = 0u;
    // Runs of neighbouring slots, so that work-items do not write to the same cache lines.
    for (uint run = 64u * item; run < count; run += 64u * step) {
        for (uint i = run; i < min(run + 64u, count); i++) {
            const uint later = rp_shade_entry(&queue, min(i + RP_FETCHED_AHEAD, count - 1u));
            rp_prefetch_path(paths, later);
            const uint slot = rp_shade_entry(&queue, i), status = rp_status_of(paths, slot);
            if (!rp_is_to_shade(status)) continue;
            uint outcome =
                rp_arrive(RP_SHADE_FROM params, materials, lights, light_steps, ranges, paths, slot, status, i >= queue.arrived, film, &reached);
            if (outcome == RP_OUTCOME_SCATTERS && reached.material->kind == RP_MATERIAL_DIFFUSE) {
                rp_gather(&gathered, &reached);
                if (gathered.count == 16u) rp_shade_gathered(params, lights, light_steps, &gathered, paths, film, mine);
                continue;
            }
            if (outcome == RP_OUTCOME_SCATTERS) outcome = rp_shade_one(params, lights, light_steps, &reached, paths, mine);
            if (outcome == RP_OUTCOME_ENDS) rp_end_path(params, paths, slot, film, reached.vertex.pixel, reached.radiance);
        }
    }
    if (gathered.count != 0u) {
        // The lanes that are empty do what the first does, to no effect.
        for (uint k = gathered.count; k < 16u; k++) {
            for (uint i = 0u; i < 13u; i++) gathered.vertex[i][k] = gathered.vertex[i][0];
#ifdef RP_SKY_PAGED
            for (uint i = 0u; i < 3u; i++) gathered.sky[i][k] = gathered.sky[i][0];
#endif
            for (uint i = 0u; i < 4u; i++) gathered.path[i][k] = gathered.path[i][0];
            for (uint i = 0u; i < 2u; i++) gathered.normal[i][k] = gathered.normal[i][0];
        }
        rp_shade_gathered(params, lights, light_steps, &gathered, paths, film, mine);
    }
}

#endif
