// The finished picture onto the canvas, pixel by pixel.
uniform sampler2D u_picture;
out vec4 o_color;

void main() {
    o_color = vec4(texelFetch(u_picture, ivec2(gl_FragCoord.xy), 0).rgb, 1.0);
}
