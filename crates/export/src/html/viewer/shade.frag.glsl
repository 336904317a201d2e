// The color of every Gaussian for one camera: a pixel of the target is a Gaussian.

uniform highp usampler2D u_dc;
uniform highp usampler2D u_sh;
uniform highp usampler2D u_material;
uniform vec3 u_dc_low;
uniform vec3 u_dc_extent;
uniform vec3 u_sh_range; // largest coefficient of bands 1, 2, 3
uniform int u_degree;
uniform int u_count;
uniform int u_mode;
uniform vec3 u_eye;
uniform vec3 u_light[25]; // radiance of the environment as harmonics, world axes
uniform mat3 u_light_from_world;
uniform float u_exposure;
uniform vec3 u_forward; // of the camera, over the unit of depths

out vec4 o_color;

const int APPEARANCE = 0, BASE_COLOR = 1, NORMAL = 2, ROUGHNESS = 3, METALLIC = 4, VISIBILITY = 5,
    OBJECT = 6, RELIT = 7, DEPTH = 8;

// Real spherical harmonics with Condon-Shortley phase, written out (Sloan 2013).
void harmonics(vec3 d, out float y[25]) {
    float xx = d.x * d.x, yy = d.y * d.y, zz = d.z * d.z;
    y[0] = 0.28209479;
    y[1] = -0.48860251 * d.y;
    y[2] = 0.48860251 * d.z;
    y[3] = -0.48860251 * d.x;
    y[4] = 1.09254843 * d.x * d.y;
    y[5] = -1.09254843 * d.y * d.z;
    y[6] = 0.31539157 * (2.0 * zz - xx - yy);
    y[7] = -1.09254843 * d.x * d.z;
    y[8] = 0.54627422 * (xx - yy);
    y[9] = -0.59004359 * d.y * (3.0 * xx - yy);
    y[10] = 2.89061144 * d.x * d.y * d.z;
    y[11] = -0.45704580 * d.y * (4.0 * zz - xx - yy);
    y[12] = 0.37317633 * d.z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
    y[13] = -0.45704580 * d.x * (4.0 * zz - xx - yy);
    y[14] = 1.44530572 * d.z * (xx - yy);
    y[15] = -0.59004359 * d.x * (xx - 3.0 * yy);
    y[16] = 2.50334294 * d.x * d.y * (xx - yy);
    y[17] = -1.77013077 * d.y * d.z * (3.0 * xx - yy);
    y[18] = 0.94617470 * d.x * d.y * (7.0 * zz - 1.0);
    y[19] = -0.66904654 * d.y * d.z * (7.0 * zz - 3.0);
    y[20] = 0.10578555 * (zz * (35.0 * zz - 30.0) + 3.0);
    y[21] = -0.66904654 * d.x * d.z * (7.0 * zz - 3.0);
    y[22] = 0.47308735 * (xx - yy) * (7.0 * zz - 1.0);
    y[23] = -1.77013077 * d.x * d.z * (xx - 3.0 * yy);
    y[24] = 0.62583573 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy));
}

// Coefficient k >= 1: three bytes, square-companded round 128.
vec3 sh_of(int i, int k) {
    float range = k < 4 ? u_sh_range.x : k < 9 ? u_sh_range.y : u_sh_range.z;
    int texels = (3 * ((u_degree + 1) * (u_degree + 1) - 1) + 15) / 16;
    ivec2 first = ivec2((i & 1023) * texels, i >> 10);
    vec3 value;
    for (int c = 0; c < 3; c++) {
        int at = 3 * (k - 1) + c;
        uint word = texelFetch(u_sh, first + ivec2(at >> 4, 0), 0)[(at >> 2) & 3];
        float q = (float((word >> (8 * (at & 3))) & 255u) - 128.0) / 127.0;
        value[c] = sign(q) * q * q * range;
    }
    return value;
}

vec3 appearance(int i, vec3 direction) {
    uint word = texelFetch(u_dc, texel_of(i), 0).x;
    vec3 steps = vec3(float(word & 2047u) / 2047.0, float((word >> 11) & 2047u) / 2047.0,
        float(word >> 22) / 1023.0);
    vec3 color = 0.5 + 0.28209479 * (u_dc_low + steps * u_dc_extent);
    if (u_degree > 0) {
        float y[25];
        harmonics(direction, y);
        int count = (u_degree + 1) * (u_degree + 1);
        for (int k = 1; k < 16; k++) {
            if (k >= count) break;
            color += y[k] * sh_of(i, k);
        }
    }
    return max(color, 0.0);
}

vec3 normal_of(uint word) {
    vec2 e = vec2(float(word & 0xffffu), float(word >> 16)) / 65535.0 * 2.0 - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return normalize(n);
}

vec3 decoded(vec3 v) {
    return mix(v / 12.92, pow((v + 0.055) / 1.055, vec3(2.4)), step(0.04045, v));
}

vec3 encoded(vec3 v) {
    v = clamp(v, 0.0, 1.0);
    return mix(v * 12.92, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v));
}

// The light in bands scaled by `band`: a cosine lobe, or a rough mirror.
vec3 light(vec3 world, float band[5]) {
    float y[25];
    harmonics(u_light_from_world * world, y);
    vec3 sum = u_light[0] * (y[0] * band[0]);
    for (int k = 1; k < 25; k++) {
        int l = k < 4 ? 1 : k < 9 ? 2 : k < 16 ? 3 : 4;
        sum += u_light[k] * (y[k] * band[l]);
    }
    return max(sum, 0.0);
}

// Irradiance from harmonics (Ramamoorthi & Hanrahan 2001) times visibility, and a reflection
// of the same harmonics, each band damped by the width of the lobe (the same authors 2002).
vec3 relit(vec3 base, vec3 normal, float roughness, float metallic, float visibility, vec3 direction) {
    const float PI = 3.14159265;
    vec3 irradiance = light(normal, float[5](PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0));
    float alpha = max(roughness * roughness, 0.03);
    float band[5];
    for (int l = 0; l < 5; l++) band[l] = exp(-alpha * float(l * l));
    float cosine = clamp(-dot(normal, direction), 0.0, 1.0);
    vec3 f0 = mix(vec3(0.04), base, metallic);
    vec3 f90 = max(vec3(1.0 - roughness), f0);
    vec3 fresnel = f0 + (f90 - f0) * pow(1.0 - cosine, 5.0);
    vec3 mirrored = light(reflect(direction, normal), band);
    vec3 diffuse = base * (1.0 - metallic) * irradiance / PI;
    return encoded(u_exposure * visibility * (diffuse + fresnel * mirrored));
}

vec3 object_color(uint id) {
    if (id == 0u) return vec3(0.35);
    // Golden steps round the circle of hues keep neighbors apart.
    float hue = fract(float(id) * 0.61803399);
    vec3 rgb = clamp(abs(fract(hue + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
    return mix(vec3(1.0), rgb, 0.7) * (0.7 + 0.3 * fract(float(id) * 0.7548777));
}

// What is selected, in any mode.
vec3 highlighted(vec3 color) {
    return mix(color, vec3(1.0, 0.55, 0.05), u_marked);
}

void main() {
    int i = int(gl_FragCoord.y) * 1024 + int(gl_FragCoord.x);
    o_color = vec4(0.0);
    if (i >= u_count) return;
    vec3 arm = mean_of(i, texelFetch(u_geometry, texel_of(i), 0)) - u_eye;
    vec3 direction = normalize(arm);
    if (u_mode == DEPTH) {
        o_color.rgb = vec3(dot(arm, u_forward));
        return;
    }
    if (u_mode == APPEARANCE) {
        o_color.rgb = appearance(i, direction);
        if (is_marked(i)) o_color.rgb = highlighted(o_color.rgb);
        return;
    }
    uvec4 m = texelFetch(u_material, texel_of(i), 0);
    vec3 base_encoded = vec3(float(m.y & 255u), float((m.y >> 8) & 255u), float((m.y >> 16) & 255u)) / 255.0;
    float roughness = float(m.y >> 24) / 255.0;
    float metallic = float(m.z & 255u) / 255.0;
    float visibility = float((m.z >> 8) & 255u) / 255.0;
    vec3 normal = normal_of(m.x);
    if (u_mode == BASE_COLOR) o_color.rgb = base_encoded;
    else if (u_mode == NORMAL) o_color.rgb = 0.5 + 0.5 * normal;
    else if (u_mode == ROUGHNESS) o_color.rgb = vec3(roughness);
    else if (u_mode == METALLIC) o_color.rgb = vec3(metallic);
    else if (u_mode == VISIBILITY) o_color.rgb = vec3(visibility);
    else if (u_mode == OBJECT) o_color.rgb = object_color(m.z >> 16);
    else if (u_mode == RELIT)
        o_color.rgb = relit(decoded(base_encoded), normal, roughness, metallic, visibility, direction);
    if (is_marked(i)) o_color.rgb = highlighted(o_color.rgb);
}
