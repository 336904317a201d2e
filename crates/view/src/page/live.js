// The page as it stands with the server: what the server says is drawn, and what people do is sent.

class Live {
  constructor(viewer, server, state) {
    this.viewer = viewer;
    this.server = server;
    this.state = state;
    this.drawn = state.drawn.id;
    this.waiting = []; // for something to be drawn
    this.tools = new Tools(this);
    this.handles = new Handles(this);
    this.sky = new Sky(this);
    this.panel = new Panel(this);
    viewer.tool = this.tools;
    this.panel.refresh();
    const frame = () => {
      this.handles.place();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  // News from the server, until it ends.
  async listen() {
    while (!this.state.over) {
      try {
        await this.take(await this.server.get(`state?after=${this.state.serial}`));
        this.lost = false;
      } catch (error) {
        this.lost = true;
        this.say("the server does not answer");
        await new Promise((resolve) => setTimeout(resolve, 1500));
      }
    }
    this.say("motes view has ended; this page only shows what it has");
  }

  // What the server said; answers may overtake each other.
  async take(state) {
    if (state.serial < this.state.serial) return;
    this.state = state;
    this.panel.refresh();
    if (state.notice && state.notice !== this.noticed) this.say(state.notice);
    this.noticed = state.notice;
    if (state.failed) this.waiting = this.waiting.filter(({ resolve }) => resolve());
    await this.follow();
  }

  // Draws what the state says, one after the other.
  async follow() {
    if (this.following) return this.following;
    this.following = (async () => {
      while (this.drawn !== this.state.drawn.id) await this.redraw(this.state);
      await this.mark();
    })().finally(() => (this.following = null));
    return this.following;
  }

  async redraw(state) {
    const { viewer } = this;
    const { id, splat: manifest } = state.drawn;
    let splat;
    try {
      splat = await viewer.splatOf(manifest, (block) => this.server.bytes(`block/${id}/${block}`));
    } catch (error) {
      // Something newer is drawn meanwhile: its state is on its way.
      if (this.state.drawn.id === id) this.state = await this.server.get("state");
      return;
    }
    const { eye, forward } = viewer.camera;
    viewer.renderer.setOrder(splat, await splat.sorter.order({ eye, forward }));
    const [old, before] = viewer.splats;
    viewer.splats[0] = splat;
    viewer.manifest.splats[0] = manifest;
    if (id === state.original) this.compareWith(null);
    else if (!before && this.drawn === state.original) this.compareWith(old);
    if (old !== viewer.splats[1]) viewer.renderer.drop(old);
    this.drawn = id;
    viewer.moved();
    viewer.describe();
    this.panel.refresh();
    this.waiting = this.waiting.filter(({ revision, resolve }) => state.drawn.revision < revision || resolve());
  }

  // The splat at the start is what edits are compared with.
  compareWith(splat) {
    const { viewer } = this;
    const old = viewer.splats[1];
    if (old && old !== splat) viewer.renderer.drop(old);
    viewer.splats.length = viewer.manifest.splats.length = 1;
    if (splat) {
      viewer.renderer.mark(splat, null);
      splat.motion = null;
      viewer.splats.push(splat);
      viewer.manifest.splats.push(splat.manifest);
    } else if (viewer.state.compare === "splat") viewer.changed({ compare: "none" });
    viewer.controls.panel();
  }

  // Marks what is selected.
  async mark() {
    const { viewer, state } = this;
    let bits = null;
    if (state.selection) {
      try {
        bits = state.mask ? bytesOfBase64(state.mask) : await this.server.bytes(`mask/${state.drawn.id}`);
      } catch {
        bits = null; // what is selected is drawn soon
      }
    }
    // What is being selected is seen at once; what was selected before lets its material be seen.
    viewer.renderer.mark(viewer.splats[0], bits, state.selection?.pending ? 0.5 : 0.15);
    viewer.dirty = true;
  }

  // Sends what somebody did; what is wrong with it is said.
  async send(path, body) {
    // What is undone or done meanwhile is not replaced.
    if (path !== "light") this.sky.landed = null;
    try {
      this.say("");
      await this.take(await this.server.post(path, body));
      return true;
    } catch (error) {
      this.say(error.message);
      return false;
    }
  }

  // When the last act is drawn, be it as a preview.
  async isDrawn() {
    const { revision, drawn, failed } = this.state;
    if (failed || drawn.revision >= revision && this.drawn === drawn.id) return;
    await new Promise((resolve) => this.waiting.push({ revision, resolve }));
  }

  // When it is drawn as `motes edit` makes it.
  async isSettled() {
    while (!this.state.settled || this.drawn !== this.state.drawn.id) await new Promise((resolve) => setTimeout(resolve, 50));
  }

  say(text) {
    $("said").textContent = text;
  }
}

async function start() {
  const server = new Server();
  const manifest = await server.get("manifest");
  const { session, state } = manifest;
  LABELS.splat = "before the edits";
  if (state.drawn.id !== state.original) manifest.splats.push(session.before);
  const viewer = new Viewer(manifest, new ServedSource(server, state));
  if (window.innerWidth <= 600) $("panel").open = false;
  await viewer.load();
  viewer.controls = new Controls(viewer);
  viewer.live = new Live(viewer, server, state);
  await viewer.live.follow();
  await viewer.sort();
  viewer.present();
  viewer.live.listen();
  return viewer;
}

// For those who measure: `await motes`, then `.live`.
window.motes = start();
window.motes.then(
  () => document.body.classList.add("ready"),
  (error) => {
    document.body.classList.add("failed");
    $("status").textContent = `This page cannot be shown: ${error.message}`;
    console.error(error);
  },
);
