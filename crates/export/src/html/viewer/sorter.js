// Back to front, in a worker where the browser allows one for a page from a file.

// The body of the worker; it must not refer to anything outside itself.
function sorterBody(scope) {
  let means = new Float32Array(0);
  let order = new Uint32Array(0);
  let keys, otherKeys, other;
  const counts = new Uint32Array(65536);

  function load(values) {
    means = values;
    const n = means.length / 3;
    [order, other, keys, otherKeys] = [0, 0, 0, 0].map(() => new Uint32Array(n));
  }

  // Least significant digit first, 16 bits at a time: stable, exact.
  function pass(n, shift, fromKeys, from, toKeys, to) {
    counts.fill(0);
    for (let i = 0; i < n; i++) counts[(fromKeys[i] >>> shift) & 0xffff]++;
    for (let sum = 0, k = 0; k < 65536; k++) {
      const count = counts[k];
      counts[k] = sum;
      sum += count;
    }
    for (let i = 0; i < n; i++) {
      const place = counts[(fromKeys[i] >>> shift) & 0xffff]++;
      toKeys[place] = fromKeys[i];
      to[place] = from[i];
    }
  }

  // `forward` is the camera's z axis in world. Gaussians behind the camera are left out.
  function sort(eye, forward) {
    const depth = new Float32Array(1);
    const bits = new Uint32Array(depth.buffer);
    const [ex, ey, ez] = eye;
    const [fx, fy, fz] = forward;
    let n = 0;
    for (let i = 0, k = 0; k < means.length; i++, k += 3) {
      depth[0] = (means[k] - ex) * fx + (means[k + 1] - ey) * fy + (means[k + 2] - ez) * fz;
      if (!(depth[0] > 0)) continue;
      // Bits of positive floats grow with them; the complement puts the far ones first.
      keys[n] = ~bits[0];
      order[n++] = i;
    }
    pass(n, 0, keys, order, otherKeys, other);
    pass(n, 16, otherKeys, other, keys, order);
    return order.slice(0, n);
  }

  scope.sorter = { load, sort };
  scope.onmessage = ({ data }) => {
    if (data.means) load(data.means);
    else {
      const sorted = sort(data.eye, data.forward);
      scope.postMessage({ id: data.id, sorted }, [sorted.buffer]);
    }
  };
}

class Sorter {
  constructor(means) {
    this.waiting = new Map();
    this.id = 0;
    this.busy = false;
    try {
      const source = `(${sorterBody})(self)`;
      const url = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
      this.worker = new Worker(url);
      this.worker.onmessage = ({ data }) => this.answer(data.id, data.sorted);
      this.worker.onerror = () => this.withoutWorker(means);
      this.worker.postMessage({ means });
    } catch {
      this.withoutWorker(means);
    }
  }

  withoutWorker(means) {
    this.worker = null;
    const scope = {};
    sorterBody(scope);
    scope.sorter.load(means);
    this.local = scope.sorter;
    for (const [id, { camera }] of this.waiting) this.answer(id, this.local.sort(camera.eye, camera.forward));
  }

  // Its Gaussians are no longer drawn.
  end() {
    this.worker?.terminate();
    for (const id of [...this.waiting.keys()]) this.answer(id, new Uint32Array(0));
  }

  answer(id, sorted) {
    this.busy = false;
    this.waiting.get(id)?.resolve(sorted);
    this.waiting.delete(id);
  }

  // Indices of the Gaussians before the camera, the farthest first.
  order(camera) {
    const id = ++this.id;
    this.busy = true;
    return new Promise((resolve) => {
      this.waiting.set(id, { resolve, camera });
      if (this.worker) this.worker.postMessage({ id, eye: camera.eye, forward: camera.forward });
      else setTimeout(() => this.answer(id, this.local.sort(camera.eye, camera.forward)));
    });
  }
}
