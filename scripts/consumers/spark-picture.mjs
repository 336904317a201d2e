// node spark-picture.mjs SPLAT CAMERA.json OUT.png
// Draws a splat file with three.js and Spark through a pinhole. CAMERA.json: {"width", "height", "fx", "fy", "cx",
// "cy", "rotation": rows of camera_from_world, "eye", "flip": whether the file has y and z the other way, as glTF and SPZ do}.

import { createServer } from "node:http";
import { existsSync, readFileSync } from "node:fs";
import { basename, extname, join, resolve } from "node:path";
import { modules, savePng, withTab } from "./browser.mjs";

const [splat, cameraFile, out] = process.argv.slice(2);
const camera = JSON.parse(readFileSync(cameraFile, "utf8"));

const PAGE = `<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><style>body{margin:0;background:#000}</style>
<script type="importmap">{"imports":{"three":"/modules/three/build/three.module.js",
"three/addons/":"/modules/three/examples/jsm/","@sparkjsdev/spark":"/modules/@sparkjsdev/spark/dist/spark.module.js"}}</script>
<script type="module">
import * as THREE from "three";
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
const c = ${JSON.stringify(camera)};
const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
renderer.setSize(c.width, c.height);
document.body.appendChild(renderer.domElement);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera();
camera.matrixAutoUpdate = false;
// Rows right, down, forward; three.js has +y up and looks along -z.
const [r, d, f] = c.rotation;
camera.matrix.set(r[0], -d[0], -f[0], c.eye[0], r[1], -d[1], -f[1], c.eye[1], r[2], -d[2], -f[2], c.eye[2], 0, 0, 0, 1);
camera.matrixWorld.copy(camera.matrix);
camera.matrixWorldInverse.copy(camera.matrix).invert();
camera.matrixWorldAutoUpdate = false;
const near = 0.01, far = 1000;
camera.near = near; camera.far = far;
camera.projectionMatrix.set(
  2 * c.fx / c.width, 0, 1 - 2 * c.cx / c.width, 0,
  0, 2 * c.fy / c.height, 2 * c.cy / c.height - 1, 0,
  0, 0, -(far + near) / (far - near), -2 * far * near / (far - near), 0, 0, -1, 0);
camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
const spark = new SparkRenderer({ renderer, preBlurAmount: 0.3, blurAmount: 0.0, maxStdDev: Math.sqrt(11), minAlpha: 1 / 255, sortRadial: false });
scene.add(spark);
const mesh = new SplatMesh({ url: "/splat/${basename(splat)}" });
if (c.flip) mesh.quaternion.set(1, 0, 0, 0);
scene.add(mesh);
await mesh.initialized;
window.splats = mesh.packedSplats?.numSplats;
window.picture = () => { renderer.render(scene, camera); return renderer.domElement.toDataURL("image/png"); };
window.loaded = true;
</script>`;

const TYPES = { ".js": "text/javascript", ".html": "text/html", ".wasm": "application/wasm" };
const server = createServer((request, response) => {
  const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
  const file = path.startsWith("/modules/") ? join(modules, path.slice(9)) : path.startsWith("/splat/") ? resolve(splat) : null;
  if (path === "/") response.setHeader("content-type", "text/html").end(PAGE);
  else if (file && existsSync(file)) response.setHeader("content-type", TYPES[extname(file)] ?? "application/octet-stream").end(readFileSync(file));
  else response.writeHead(404).end();
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
try {
  const report = await withTab({ width: camera.width, height: camera.height }, async (tab) => {
    await tab.goto(`http://127.0.0.1:${server.address().port}/`);
    await tab.waitForFunction(() => window.loaded, null, { timeout: 120000 });
    // Sorting runs in a worker: the picture is done when two in a row are equal.
    let [before, after] = ["", await tab.evaluate(() => window.picture())];
    for (let i = 0; i < 40 && before !== after; i++) {
      await tab.waitForTimeout(1000);
      [before, after] = [after, await tab.evaluate(() => window.picture())];
    }
    savePng(out, after);
    return { splats: await tab.evaluate(() => window.splats), stable: before === after };
  });
  console.log(JSON.stringify(report));
} finally {
  server.close();
}
