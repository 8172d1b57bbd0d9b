// A cloud of points in sensor space (x forward, y left, z up), by WebGL. 8 bytes each: x, y, z as
// i16 in centimetres, tag, attribute.

const VERTEX = `
attribute vec3 place; attribute vec2 label;
uniform mat4 clipFromSensor; uniform vec3 colors[29]; uniform bool isByTag; uniform float size;
varying vec3 color;
void main() {
  vec3 metres = place * 0.01;
  gl_Position = clipFromSensor * vec4(metres, 1.0);
  gl_PointSize = size;
  float h = clamp((metres.z + 3.0) / 8.0, 0.0, 1.0);
  color = 0.5 + 0.5 * cos(6.2832 * (h * 0.8 + vec3(0.66, 0.33, 0.0)));
  if (isByTag) for (int i = 0; i < 29; i++) if (i == int(label.x + 0.5)) color = colors[i] + 0.12;
}`;
const FRAGMENT = `
precision mediump float; varying vec3 color;
void main() { gl_FragColor = vec4(color, 1.0); }`;

export class PointView {
  constructor(canvas, tagColors) {
    this.canvas = canvas;
    this.isByTag = false;
    this.count = 0;
    [this.azimuth, this.elevation, this.distance] = [Math.PI, 0.5, 45];
    const gl = this.gl = canvas.getContext("webgl", { antialias: false });
    if (!gl) return;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "place");
    gl.bindAttribLocation(program, 1, "label");
    gl.linkProgram(program);
    gl.useProgram(program);
    const at = (name) => gl.getUniformLocation(program, name);
    this.uniforms = { matrix: at("clipFromSensor"), isByTag: at("isByTag"), size: at("size") };
    gl.uniform3fv(at("colors"), tagColors.flat().map((c) => c / 255));
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 3, gl.SHORT, false, 8, 0);
    gl.vertexAttribPointer(1, 2, gl.UNSIGNED_BYTE, false, 8, 6);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.04, 0.05, 0.06, 1);
    canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
    canvas.onpointermove = (event) => {
      if (!event.buttons) return;
      this.azimuth -= event.movementX * 0.006;
      this.elevation = Math.min(1.55, Math.max(0.02, this.elevation + event.movementY * 0.006));
      this.draw();
    };
    canvas.onwheel = (event) => {
      event.preventDefault();
      this.distance = Math.min(200, Math.max(3, this.distance * 1.0015 ** event.deltaY));
      this.draw();
    };
  }

  load(buffer) {
    this.count = buffer.byteLength / 8;
    this.gl?.bufferData(this.gl.ARRAY_BUFFER, buffer, this.gl.DYNAMIC_DRAW);
    this.draw();
  }

  draw() {
    const { gl, canvas } = this;
    if (!gl) return;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, n * devicePixelRatio | 0));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.uniforms.matrix, false, this.matrix(width / height));
    gl.uniform1i(this.uniforms.isByTag, this.isByTag);
    gl.uniform1f(this.uniforms.size, 1.6 * devicePixelRatio);
    gl.drawArrays(gl.POINTS, 0, this.count);
  }

  // `clip_from_sensor`, column by column: the eye looks at the sensor from behind and above.
  matrix(aspect) {
    const { azimuth: a, elevation: e, distance: d } = this;
    const forward = [-Math.cos(e) * Math.cos(a), -Math.cos(e) * Math.sin(a), -Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    const up = [
      right[1] * forward[2] - right[2] * forward[1],
      right[2] * forward[0] - right[0] * forward[2],
      right[0] * forward[1] - right[1] * forward[0],
    ];
    const f = 1.5, [near, far] = [0.5, 500];
    const [p, q] = [(far + near) / (far - near), -2 * far * near / (far - near)];
    // Clip x, y, z, w of a point v in sensor space, whose view space position is v − d·(−forward).
    const rows = [
      [...right.map((n) => n * f / aspect), 0],
      [...up.map((n) => n * f), 0],
      [...forward.map((n) => n * p), d * p + q],
      [...forward, d],
    ];
    return new Float32Array([0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column])));
  }
}
