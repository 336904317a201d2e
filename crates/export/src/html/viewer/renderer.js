// WebGL2: the color of every Gaussian into a texture, then the Gaussians back to front into a
// half-float picture, then the picture onto the canvas.

const MODES = ["appearance", "base_color", "normal", "roughness", "metallic", "visibility", "object_id", "relit", "depth"];

class Renderer {
  constructor(canvas, shaders) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, depth: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this page needs WebGL 2, which the browser has not or has switched off");
    this.gl = gl;
    // 8 bits per blended layer lose up to half a step each; without the extension they must do.
    this.isFloat = Boolean(gl.getExtension("EXT_color_buffer_float") || gl.getExtension("EXT_color_buffer_half_float"));
    const head = "#version 300 es\nprecision highp float;\nprecision highp int;\n";
    const g = shaders.gaussian;
    this.shade = this.program(head + shaders.full_vert, head + g + shaders.shade_frag);
    this.splat = this.program(head + g + shaders.splat_vert, head + shaders.splat_frag);
    this.show = this.program(head + shaders.full_vert, head + shaders.show_frag);
    this.empty = gl.createVertexArray();
    this.picture = null;
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`shader: ${logs.join(" ")} ${gl.getProgramInfoLog(program)}`);
    }
    const places = {};
    const n = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < n; i++) {
      const name = gl.getActiveUniform(program, i).name.replace("[0]", "");
      places[name] = gl.getUniformLocation(program, name);
    }
    return { program, at: (name) => places[name] ?? null };
  }

  texture(format, width, height) {
    const gl = this.gl;
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (width > limit || height > limit) throw new Error(`${width} x ${height} texels are more than this graphics processor takes (${limit})`);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, Math.max(width, 1), Math.max(height, 1));
    return texture;
  }

  target(width, height) {
    const gl = this.gl;
    const texture = this.texture(this.isFloat ? gl.RGBA16F : gl.RGBA8, width, height);
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    return { texture, framebuffer, width, height };
  }

  // Room for the Gaussians of a manifest; blocks follow one by one.
  splatOf(manifest) {
    const gl = this.gl;
    const rows = Math.ceil(manifest.count / ROW);
    const texels = strides(manifest).shPadded / 16;
    const splat = {
      manifest,
      geometry: this.texture(gl.RGBA32UI, ROW, rows),
      chunks: this.texture(gl.RGBA32F, (2 * BLOCK) / CHUNK, Math.ceil(manifest.count / BLOCK)),
      dc: this.texture(gl.R32UI, ROW, rows),
      sh: this.texture(gl.RGBA32UI, texels ? ROW * texels : 1, texels ? rows : 1),
      material: this.texture(gl.RGBA32UI, manifest.materials ? ROW : 1, manifest.materials ? rows : 1),
      marks: this.texture(gl.R8UI, ROW, rows),
      marked: 0,
      colors: this.target(ROW, rows),
      order: gl.createBuffer(),
      visible: 0,
      vertices: gl.createVertexArray(),
    };
    gl.bindVertexArray(splat.vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, splat.order);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    return splat;
  }

  upload(splat, index, block) {
    const gl = this.gl;
    const rows = Math.ceil(block.count / ROW);
    const y = index * (BLOCK / ROW);
    const put = (texture, width, height, top, format, type, data) => {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, top, width, height, format, type, data);
    };
    const words = (bytes) => new Uint32Array(bytes.buffer);
    const { RGBA_INTEGER, RED_INTEGER, UNSIGNED_INT } = gl;
    put(splat.geometry, ROW, rows, y, RGBA_INTEGER, UNSIGNED_INT, words(block.geometry));
    put(splat.dc, ROW, rows, y, RED_INTEGER, UNSIGNED_INT, words(block.dc));
    const texels = strides(splat.manifest).shPadded / 16;
    if (texels) put(splat.sh, ROW * texels, rows, y, RGBA_INTEGER, UNSIGNED_INT, words(block.sh));
    if (splat.manifest.materials) put(splat.material, ROW, rows, y, RGBA_INTEGER, UNSIGNED_INT, words(block.material));
    // Three floats of low corner and of extent become two texels.
    const boxes = new Float32Array((8 * block.chunks.length) / 6);
    for (let i = 0; i < block.chunks.length; i++) boxes[4 * Math.floor(i / 3) + (i % 3)] = block.chunks[i];
    put(splat.chunks, boxes.length / 4, 1, index, gl.RGBA, gl.FLOAT, boxes);
  }

  // Marks Gaussians as strongly as `marked` says, 0 to 1: a bit each, the first one in the lowest bit of the first byte; none when
  // `bits` is null.
  mark(splat, bits, marked = 0.5) {
    splat.marked = bits ? marked : 0;
    if (!bits) return;
    const gl = this.gl;
    const rows = Math.ceil(splat.manifest.count / ROW);
    const marks = new Uint8Array(ROW * rows);
    for (let i = 0; i < splat.manifest.count; i++) marks[i] = (bits[i >> 3] >> (i & 7)) & 1;
    gl.bindTexture(gl.TEXTURE_2D, splat.marks);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, rows, gl.RED_INTEGER, gl.UNSIGNED_BYTE, marks);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  }

  // Gives back what a splat takes on the graphics processor.
  drop(splat) {
    const gl = this.gl;
    for (const key of ["geometry", "chunks", "dc", "sh", "material", "marks"]) gl.deleteTexture(splat[key]);
    gl.deleteTexture(splat.colors.texture);
    gl.deleteFramebuffer(splat.colors.framebuffer);
    gl.deleteBuffer(splat.order);
    gl.deleteVertexArray(splat.vertices);
    splat.sorter.end();
  }

  // What the shaders know of marked Gaussians: where they are being moved to, as scale, rotation and translation.
  setMarks(program, splat) {
    const gl = this.gl;
    const { scale, rotation, translation } = splat.motion ?? { scale: 1, rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1], translation: [0, 0, 0] };
    gl.uniform1f(program.at("u_marked"), splat.marked);
    gl.uniform1f(program.at("u_motion_scale"), scale);
    gl.uniformMatrix3fv(program.at("u_motion_rotation"), false, rotation);
    gl.uniform3fv(program.at("u_motion_translation"), translation);
  }

  setOrder(splat, sorted) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, splat.order);
    gl.bufferData(gl.ARRAY_BUFFER, sorted, gl.DYNAMIC_DRAW);
    splat.visible = sorted.length;
  }

  bind(program, textures) {
    const gl = this.gl;
    gl.useProgram(program.program);
    Object.entries(textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(program.at(name), unit);
    });
  }

  // Colors of all Gaussians of a splat for a camera.
  shadeColors(splat, camera, mode, light) {
    const { gl, shade } = this;
    const m = splat.manifest;
    const { geometry, chunks, dc, sh, material, marks, colors } = splat;
    this.bind(shade, { u_geometry: geometry, u_chunks: chunks, u_dc: dc, u_sh: sh, u_material: material, u_marks: marks });
    this.setMarks(shade, splat);
    gl.uniform3fv(shade.at("u_dc_low"), m.dc_low);
    gl.uniform3fv(shade.at("u_dc_extent"), m.dc_extent);
    gl.uniform3fv(shade.at("u_sh_range"), m.sh_range);
    gl.uniform1i(shade.at("u_degree"), m.sh_degree);
    gl.uniform1i(shade.at("u_count"), m.count);
    gl.uniform1i(shade.at("u_mode"), MODES.indexOf(mode));
    gl.uniform3fv(shade.at("u_eye"), camera.eye);
    gl.uniform3fv(shade.at("u_light"), light.harmonics);
    gl.uniformMatrix3fv(shade.at("u_light_from_world"), false, light.lightFromWorld);
    gl.uniform1f(shade.at("u_exposure"), light.exposure);
    gl.uniform3fv(shade.at("u_forward"), scaled(camera.axes[2], 1 / (light.unit ?? 1)));
    gl.bindFramebuffer(gl.FRAMEBUFFER, colors.framebuffer);
    gl.viewport(0, 0, colors.width, colors.height);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // Parts of the picture, each with a splat, a mode, a light and a range of columns [from, to), and maybe one row.
  draw(parts, camera, pinhole, background) {
    const { gl, splat: program } = this;
    const { width, height } = pinhole;
    if (this.picture?.width !== width || this.picture?.height !== height) {
      if (this.picture) {
        gl.deleteTexture(this.picture.texture);
        gl.deleteFramebuffer(this.picture.framebuffer);
      }
      this.picture = this.target(width, height);
    }
    for (const part of parts) {
      const [from, to] = part.columns;
      if (!(to > from)) continue;
      this.shadeColors(part.splat, camera, part.mode, part.light);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture.framebuffer);
      gl.viewport(0, 0, width, height);
      gl.enable(gl.SCISSOR_TEST);
      if (part.row === undefined) gl.scissor(from, 0, to - from, height);
      else gl.scissor(from, height - 1 - part.row, to - from, 1);
      gl.clearColor(...background, part.mode === "depth" ? 0 : 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      const { geometry, chunks, marks, colors, manifest } = part.splat;
      this.bind(program, { u_geometry: geometry, u_chunks: chunks, u_colors: colors.texture, u_marks: marks });
      this.setMarks(program, part.splat);
      gl.uniform2fv(program.at("u_log_scale_range"), manifest.log_scale_range);
      // Columns of the matrix; the rows are right, down, forward.
      const columns = [0, 1, 2].flatMap((k) => camera.axes.map((axis) => axis[k]));
      gl.uniformMatrix3fv(program.at("u_camera_from_world"), false, columns);
      gl.uniform3fv(program.at("u_eye"), camera.eye);
      gl.uniform2f(program.at("u_focal"), pinhole.fx, pinhole.fy);
      gl.uniform2f(program.at("u_principal"), pinhole.cx, pinhole.cy);
      gl.uniform2f(program.at("u_size"), width, height);
      gl.uniform1i(program.at("u_mip"), manifest.mip ? 1 : 0);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.bindVertexArray(part.splat.vertices);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, part.splat.visible);
      gl.disable(gl.SCISSOR_TEST);
      gl.disable(gl.BLEND);
    }
  }

  // Mean depth along the view axis of what covers a pixel; 0 where nothing does, or the numbers are too coarse.
  depth(splat, camera, pinhole, x, y, unit, least) {
    if (!this.isFloat || x < 0 || y < 0 || x >= pinhole.width || y >= pinhole.height) return 0;
    const light = { harmonics: new Array(75).fill(0), lightFromWorld: [1, 0, 0, 0, 1, 0, 0, 0, 1], exposure: 1, unit };
    this.draw([{ splat, mode: "depth", light, columns: [x, x + 1], row: y }], camera, pinhole, [0, 0, 0]);
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture.framebuffer);
    const value = new Float32Array(4);
    gl.readPixels(x, pinhole.height - 1 - y, 1, 1, gl.RGBA, gl.FLOAT, value);
    return value[3] >= least ? (unit * value[0]) / value[3] : 0;
  }

  // The last picture onto the canvas, which has its size.
  present() {
    const { gl, show, picture } = this;
    this.bind(show, { u_picture: picture.texture });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, picture.width, picture.height);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // The last picture as RGBA bytes, row 0 at the top.
  pixels() {
    const { gl, picture } = this;
    const { width, height } = picture;
    gl.bindFramebuffer(gl.FRAMEBUFFER, picture.framebuffer);
    const bytes = new Uint8ClampedArray(width * height * 4);
    if (this.isFloat) {
      const floats = new Float32Array(width * height * 4);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, floats);
      for (let i = 0; i < bytes.length; i++) bytes[i] = 255 * floats[i];
    } else gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const flipped = new Uint8ClampedArray(bytes.length);
    for (let y = 0; y < height; y++) flipped.set(bytes.subarray(4 * width * y, 4 * width * (y + 1)), 4 * width * (height - 1 - y));
    return flipped;
  }
}
