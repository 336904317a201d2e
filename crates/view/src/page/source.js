// The server that the page came from. All addresses are below that of the page, which has the token.

class Server {
  async get(path) {
    return this.answer(await fetch(path, { cache: "no-store" }));
  }

  async bytes(path) {
    const response = await fetch(path, { cache: "no-store" });
    if (!response.ok) throw new Error((await response.json()).error);
    return new Uint8Array(await response.arrayBuffer());
  }

  async post(path, body = {}) {
    const headers = { "Content-Type": "application/json" };
    return this.answer(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }));
  }

  async answer(response) {
    const value = await response.json();
    if (!response.ok) throw new Error(value.error);
    return value;
  }
}

// Blocks and photos for the viewer.
class ServedSource {
  constructor(server, state) {
    this.server = server;
    this.ids = [state.drawn.id, state.original];
  }

  block(splat, index) {
    return this.server.bytes(`block/${this.ids[splat]}/${index}`);
  }

  photo(view) {
    return `photo/${view}`;
  }
}
