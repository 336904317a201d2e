// One Gaussian from the packed textures; the layout is in docs/formats/html-page.md.
// Row y of every texture but u_chunks holds Gaussians 1024 y ... 1024 y + 1023.

uniform highp usampler2D u_geometry;
uniform highp sampler2D u_chunks;
uniform vec2 u_log_scale_range;
uniform highp usampler2D u_marks; // 1 where a Gaussian is selected
uniform float u_marked; // how strongly it is shown, 0: nothing is selected
uniform float u_motion_scale; // of selected Gaussians while they are dragged: scale, rotation, translation
uniform mat3 u_motion_rotation;
uniform vec3 u_motion_translation;

struct Gaussian {
    vec3 mean;
    vec3 scale;
    mat3 rotation; // columns: local axes in world
    float opacity;
};

ivec2 texel_of(int i) {
    return ivec2(i & 1023, i >> 10);
}

vec3 mean_of(int i, uvec4 g) {
    ivec2 chunk = ivec2(2 * ((i >> 8) & 255), i >> 16);
    vec3 low = texelFetch(u_chunks, chunk, 0).xyz;
    vec3 extent = texelFetch(u_chunks, chunk + ivec2(1, 0), 0).xyz;
    vec3 share = vec3(float(g.x & 0xffffu), float(g.x >> 16), float(g.y & 0xffffu)) / 65535.0;
    return low + share * extent;
}

bool is_marked(int i) {
    return u_marked > 0.0 && texelFetch(u_marks, texel_of(i), 0).x != 0u;
}

// The three smaller components of a unit quaternion (w, x, y, z), the largest left out.
vec4 quaternion_of(uint bits) {
    vec3 three = vec3(float(bits & 1023u), float((bits >> 10) & 1023u), float((bits >> 20) & 1023u));
    three = (three / 1023.0 - 0.5) * 1.41421356;
    float largest = sqrt(max(0.0, 1.0 - dot(three, three)));
    uint place = bits >> 30;
    if (place == 0u) return vec4(largest, three);
    if (place == 1u) return vec4(three.x, largest, three.yz);
    if (place == 2u) return vec4(three.xy, largest, three.z);
    return vec4(three, largest);
}

mat3 matrix_of(vec4 q) {
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

Gaussian gaussian_of(int i) {
    uvec4 g = texelFetch(u_geometry, texel_of(i), 0);
    vec3 steps = vec3(float((g.y >> 16) & 4095u), float(g.z & 4095u), float((g.z >> 12) & 4095u));
    vec3 log_scale = mix(vec3(u_log_scale_range.x), vec3(u_log_scale_range.y), steps / 4095.0);
    float opacity = float((g.z >> 24 << 4) | (g.y >> 28)) / 4095.0;
    Gaussian own = Gaussian(mean_of(i, g), exp(log_scale), matrix_of(quaternion_of(g.w)), opacity);
    if (is_marked(i)) {
        own.mean = u_motion_rotation * (u_motion_scale * own.mean) + u_motion_translation;
        own.scale *= u_motion_scale;
        own.rotation = u_motion_rotation * own.rotation;
    }
    return own;
}
