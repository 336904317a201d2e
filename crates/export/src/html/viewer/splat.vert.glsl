// A quad round the ellipse of one projected Gaussian.
//
// The projection is that of motes' rasterizer: Sigma' = J W Sigma W^T J^T + 0.3 px^2 (Zwicker et
// al. 2001), the Jacobian evaluated inside the field of view and 15 % of the image round it.

uniform mat3 u_camera_from_world;
uniform vec3 u_eye;
uniform vec2 u_focal;
uniform vec2 u_principal;
uniform vec2 u_size;
uniform bool u_mip;
uniform sampler2D u_colors;

layout(location = 0) in uint a_index;

out vec2 v_offset; // in standard deviations
flat out vec4 v_color; // encoded color, opacity

const float BLUR = 0.3;
const float ALPHA_MIN = 1.0 / 255.0;

void main() {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // outside: nothing is drawn
    int i = int(a_index);
    Gaussian g = gaussian_of(i);
    vec3 offset = g.mean - u_eye;
    vec3 p = u_camera_from_world * offset;
    if (!(p.z > 1e-3 * length(p))) return;
    // A camera inside the ellipsoid of one standard deviation sees no ellipse.
    vec3 local = (transpose(g.rotation) * offset) / max(g.scale, vec3(1e-18));
    if (!(dot(local, local) > 1.0)) return;

    vec2 low = (-u_principal - 0.15 * u_size) / u_focal;
    vec2 high = (u_size - u_principal + 0.15 * u_size) / u_focal;
    vec2 slope = clamp(p.xy / p.z, low, high);
    mat3 world_from_camera = transpose(u_camera_from_world);
    vec3 row_x = (world_from_camera[0] - world_from_camera[2] * slope.x) * (u_focal.x / p.z);
    vec3 row_y = (world_from_camera[1] - world_from_camera[2] * slope.y) * (u_focal.y / p.z);
    vec3 u = (transpose(g.rotation) * row_x) * g.scale;
    vec3 v = (transpose(g.rotation) * row_y) * g.scale;
    float xx = dot(u, u) + BLUR;
    float yy = dot(v, v) + BLUR;
    float xy = dot(u, v);
    vec3 area = cross(u, v);
    float sharp = dot(area, area);
    float determinant = sharp + BLUR * (dot(u, u) + dot(v, v)) + BLUR * BLUR;
    float opacity = g.opacity * (u_mip ? sqrt(sharp / determinant) : 1.0);
    if (!(opacity > ALPHA_MIN)) return;

    // Axes of the ellipse: half trace plus or minus half the difference of the eigenvalues.
    float middle = 0.5 * (xx + yy);
    float half_difference = length(vec2(0.5 * (xx - yy), xy));
    float large = middle + half_difference;
    float small = determinant / large;
    // The better conditioned of the two forms of the first eigenvector.
    vec2 axis = xx > yy ? vec2(large - yy, xy) : vec2(xy, large - xx);
    axis = dot(axis, axis) > 0.0 ? normalize(axis) : vec2(1.0, 0.0);
    float reach = sqrt(2.0 * log(opacity / ALPHA_MIN));
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    v_offset = corner * reach;
    vec2 shift = axis * (v_offset.x * sqrt(large)) + vec2(-axis.y, axis.x) * (v_offset.y * sqrt(small));
    vec2 pixel = u_focal * (p.xy / p.z) + u_principal + shift;
    v_color = vec4(texelFetch(u_colors, texel_of(i), 0).rgb, opacity);
    gl_Position = vec4(2.0 * pixel.x / u_size.x - 1.0, 1.0 - 2.0 * pixel.y / u_size.y, 0.0, 1.0);
}
