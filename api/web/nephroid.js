// A client of the service for browsers and other JavaScript: submit, follow, cancel. No dependencies.
//
//   import { Nephroid } from "http://127.0.0.1:8080/nephroid.js";
//   const nephroid = new Nephroid("http://127.0.0.1:8080", { key: "nph_…" });
//   const job = await nephroid.submit(scene);
//   for await (const now of nephroid.follow(job.id)) console.log(now.state, now.progress, now.error_estimate);
//   const png = await nephroid.picture(job.id);
//
// Pages of another origin need `--cors-origin` at the service. Every method takes `{ signal }` to give up.

/** An answer that was not a success; `problem` is the RFC 9457 document: `code`, `detail`, `errors`. */
export class NephroidProblem extends Error {
  constructor(problem) {
    super(problem.detail ?? problem.title ?? "The request failed.");
    this.name = "NephroidProblem";
    this.problem = problem;
  }
}

export class Nephroid {
  /**
   * @param {string} base address of the service without a final slash; empty for this page's own
   * @param {{ key?: string }} options an API key, if the service asks for one and the page has no session
   */
  constructor(base = "", { key } = {}) {
    this.base = base;
    this.headers = key ? { Authorization: `Bearer ${key}` } : {};
  }

  /** Whether this client may use the service: `{ key_needed, welcome }`. */
  async session({ signal } = {}) {
    return (await this.#send("/v1/session", { signal })).json();
  }

  /** Keeps a key in a cookie, for pages of the service's own origin. */
  async signIn(key) {
    const headers = { "Content-Type": "application/json" };
    await this.#send("/v1/session", { method: "POST", headers, body: JSON.stringify({ key }) });
  }

  /**
   * Sends a scene (text, or an object to be written as JSON). Resolves with the job once it is on disk. The service
   * cancels it if it is not done `cancelAfter` seconds later.
   */
  async submit(scene, { idempotencyKey, label, cancelAfter, signal } = {}) {
    const headers = { "Content-Type": "application/json" };
    if (idempotencyKey) headers["Idempotency-Key"] = idempotencyKey;
    const given = Object.entries({ label, cancel_after: cancelAfter }).filter(([, value]) => value !== undefined);
    return (await this.#send(`/v1/renders?${new URLSearchParams(given)}`, { method: "POST", headers, body: textOf(scene), signal })).json();
  }

  /** What would run for a scene, and why. */
  async plan(scene, { signal } = {}) {
    const headers = { "Content-Type": "application/json" };
    return (await this.#send("/v1/plans", { method: "POST", headers, body: textOf(scene), signal })).json();
  }

  /** Sends a mesh or picture; resolves with the name by which scenes refer to it. */
  async upload(blob, { signal } = {}) {
    const digest = await crypto.subtle.digest("SHA-256", await blob.arrayBuffer());
    const name = [...new Uint8Array(digest)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
    const headers = { "Content-Type": "application/octet-stream" };
    await this.#send(`/v1/assets/${name}`, { method: "PUT", headers, body: blob, signal });
    return name;
  }

  /** What a scene may hold, as JSON Schema. */
  async schema({ signal } = {}) {
    return (await this.#send("/v1/schema", { signal })).json();
  }

  /** A job as it is now. */
  async get(id, { signal } = {}) {
    return (await this.#send(`/v1/renders/${id}`, { signal })).json();
  }

  /** Jobs, newest first: `{ renders, next_cursor }`. */
  async list(query = {}, { signal } = {}) {
    const given = Object.entries(query).filter(([, value]) => value !== undefined && value !== null);
    return (await this.#send(`/v1/renders?${new URLSearchParams(given)}`, { signal })).json();
  }

  /** The sample scenes: `[{ name, title, href }]`. */
  async samples({ signal } = {}) {
    return (await (await this.#send("/v1/scenes", { signal })).json()).scenes;
  }

  /** The text of a sample scene. */
  async sample(name, { signal } = {}) {
    return (await this.#send(`/v1/scenes/${encodeURIComponent(name)}`, { signal })).text();
  }

  /** The text of the scene that a job renders. */
  async scene(id, { signal } = {}) {
    return (await this.#send(`/v1/renders/${id}/scene.json`, { signal })).text();
  }

  /** The picture of the finished rounds as a Blob, or null while there is none. */
  async preview(id, { signal } = {}) {
    const answer = await fetch(`${this.base}/v1/renders/${id}/preview.png`, { headers: this.headers, signal });
    if (answer.status === 409) return null;
    return (await checked(answer)).blob();
  }

  /** A finished picture as a Blob: `image.png`, `image.exr`, `error.png`, `layers/caustic.png` or `.exr`, `chart.svg`. */
  async picture(id, name = "image.png", { signal } = {}) {
    return (await this.#send(`/v1/renders/${id}/${name}`, { signal })).blob();
  }

  /** Stops a job; harmless if it is done. Resolves with the job. */
  async cancel(id) {
    return (await this.#send(`/v1/renders/${id}/cancel`, { method: "POST" })).json();
  }

  /** Stops a job and forgets it with its pictures. */
  async remove(id) {
    await this.#send(`/v1/renders/${id}`, { method: "DELETE" });
  }

  /**
   * Yields the job whenever it has changed, the last time when it is done. It asks now and then; events of the
   * service only have it ask sooner. A service that restarts is waited for: the job goes on after it.
   */
  async *follow(id, { signal, interval = 500, events = true } = {}) {
    const hints = new Hints(events && !this.headers.Authorization ? `${this.base}/v1/renders/${id}/events` : null);
    let tag = null;
    let failures = 0;
    try {
      for (;;) {
        try {
          const headers = { ...this.headers, ...(tag ? { "If-None-Match": tag } : {}) };
          const answer = await fetch(`${this.base}/v1/renders/${id}`, { headers, signal, cache: "no-store" });
          failures = 0;
          if (answer.status !== 304) {
            const job = await (await checked(answer)).json();
            tag = answer.headers.get("ETag");
            yield job;
            if (job.done) return;
          }
        } catch (error) {
          const lost = error instanceof TypeError || error.problem?.status === 503;
          failures += 1;
          if (signal?.aborted || !lost || failures > 60) throw error;
        }
        await hints.next(Math.min(interval * 2 ** failures, 5000), signal);
      }
    } finally {
      hints.close();
    }
  }

  async #send(path, options = {}) {
    return checked(await fetch(this.base + path, { ...options, headers: { ...this.headers, ...options.headers } }));
  }
}

/** Waits for a time, or until the service says that there is something new. */
class Hints {
  #source = null;
  #news = false;
  #wake = null;

  constructor(address) {
    if (!address || !("EventSource" in globalThis)) return;
    this.#source = new EventSource(address);
    this.#source.addEventListener("render", () => ((this.#news = true), this.#wake?.()));
  }

  next(milliseconds, signal) {
    return new Promise((resolve, reject) => {
      const end = (settle, value) => {
        clearTimeout(timer);
        signal?.removeEventListener("abort", abort);
        this.#wake = null;
        this.#news = false;
        settle(value);
      };
      const abort = () => end(reject, signal.reason);
      const timer = setTimeout(() => end(resolve), milliseconds);
      if (signal?.aborted) return abort();
      signal?.addEventListener("abort", abort, { once: true });
      this.#wake = () => end(resolve);
      if (this.#news) this.#wake();
    });
  }

  close() {
    this.#source?.close();
  }
}

function textOf(scene) {
  return typeof scene === "string" ? scene : JSON.stringify(scene);
}

async function checked(answer) {
  if (answer.ok) return answer;
  const unknown = { title: answer.statusText, status: answer.status };
  throw new NephroidProblem(await answer.json().catch(() => unknown));
}
