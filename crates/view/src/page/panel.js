// The panel that edits.

class Panel {
  constructor(live) {
    this.live = live;
    const { session } = live.viewer.manifest;
    $("material").replaceChildren(...session.materials.map((name) => new Option(name.replaceAll("_", " "), name)));
    $("help-click").textContent = "selects; Shift: takes away from the selection";
    const on = (id, act) => ($(id).onclick = act);
    on("box", () => live.tools.use("box"));
    on("brush", () => live.tools.use("brush"));
    on("remove", () => this.toggleRemove());
    on("clear", () => live.send("clear"));
    on("delete", () => this.remove());
    on("set-material", () => live.send("act", { op: { op: "set_material", name: $("material").value } }));
    on("undo", () => live.send("undo"));
    on("redo", () => live.send("redo"));
    on("compare-before", () => this.beforeAfter());
    on("copy-command", () => this.copyCommand());
    on("quit", () => this.quit());
    $("keep").onsubmit = async (event) => {
      event.preventDefault();
      if (await live.send("keep", { name: $("name").value })) $("name").value = "";
      // Whoever went on meanwhile keeps the focus; the body has it once the field is disabled.
      const { activeElement } = document;
      if (activeElement === document.body || $("keep").contains(activeElement)) $("canvas").focus();
    };
    for (const id of ["box", "brush"]) $(id).disabled = !session.views;
    if (window.innerWidth <= 600) $("edit").open = false;
  }

  toggleRemove() {
    this.live.tools.removes = !this.live.tools.removes;
    this.refresh();
  }

  remove() {
    if (this.live.state.selection) this.live.send("act", { op: { op: "delete", fill: $("fill").value } });
  }

  // Half of the picture as it was.
  beforeAfter() {
    const { viewer } = this.live;
    if (viewer.splats.length < 2) return this.live.say("nothing was changed yet");
    viewer.controls.set("compare", viewer.state.compare === "splat" ? "none" : "splat");
    viewer.changed({ how: "slider" });
    this.refresh();
  }

  async copyCommand() {
    const text = this.live.state.command.map(quotedWord).join(" ");
    await this.live.viewer.pointer.copy(text, "the command; it needs the saved plan");
    this.live.say(`copied: ${text}`);
  }

  async quit() {
    if (await this.live.send("quit")) this.live.say("motes view has ended; this page only shows what it has");
  }

  // What an act says.
  text(op) {
    const rest = Object.entries(op).filter(([key, value]) => key !== "op" && value !== null && !(key === "rotate_deg" && value === 0) && !(key === "exposure" && value === 1));
    const short = (key, value) => {
      if (key === "steps") return `${value.length === 1 ? "" : `${value.length} steps, `}${this.prompt(value)}`;
      if (key === "file") return String(value).split("/").pop();
      return typeof value === "object" ? JSON.stringify(value) : value;
    };
    return `${op.op.replaceAll("_", " ")} ${rest.map(([key, value]) => `${key.replaceAll("_", " ")} ${short(key, value)}`).join(", ")}`;
  }

  prompt(steps) {
    const [{ by, clicks = [], boxes = [], scribbles = [] }] = steps;
    const named = [[clicks, "clicks"], [boxes, "boxes"], [scribbles, "strokes"]].filter(([list]) => list.length);
    return named.length ? named.map(([list, name]) => `${list.length} ${list.length === 1 ? name.replace(/e?s$/, name === "boxes" ? "" : "") : name}`).join(", ") : `by ${by}`;
  }

  refresh() {
    const { state, tools, viewer } = this.live;
    if (!tools) return;
    const { selection } = state;
    const pressed = (id, yes) => $(id).setAttribute("aria-pressed", String(yes));
    pressed("box", tools.mode === "box");
    pressed("brush", tools.mode === "brush");
    pressed("remove", tools.removes);
    pressed("compare-before", viewer.state.compare === "splat");
    const count = selection && `${selection.count.toLocaleString("en")} Gaussians${selection.name ? `: ${selection.name}` : ""}`;
    const views = { preparing: "preparing the views for clicks …", ready: "click on something", none: "click on something" };
    $("selected").textContent = count || (views[state.views] ?? `clicks cannot select: ${state.views}`);
    for (const id of ["delete", "set-material", "clear"]) $(id).disabled = !selection;
    $("name").disabled = $("keep-button").disabled = !selection?.pending;
    $("undo").disabled = !state.steps.length;
    $("redo").disabled = !state.can_redo;
    $("compare-before").disabled = viewer.splats.length < 2;
    const named = state.selections.map((name) => {
      const button = Object.assign(document.createElement("button"), { textContent: name });
      button.onclick = () => this.live.send("choose", { name });
      button.setAttribute("aria-pressed", String(selection?.name === name));
      return button;
    });
    $("named").replaceChildren(...named);
    $("steps").replaceChildren(...state.steps.map((op) => Object.assign(document.createElement("li"), { textContent: this.text(op) })));
    const light = state.settled ? "" : state.drawn.revision === state.revision ? "preview; the light is following …" : "working …";
    $("quality").textContent = light;
    this.live.sky.follow(state.steps);
    document.body.classList.toggle("working", !state.settled);
    $("save-splat").setAttribute("aria-disabled", String(!state.settled));
    const warned = state.drawn.warnings.join("\n");
    if (warned && warned !== this.warned) this.live.say(warned);
    this.warned = warned;
  }
}
