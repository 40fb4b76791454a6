// A small client of the service, for this page and for others: submit, follow, cancel.
//
//   const nephroid = new Nephroid();
//   const job = await nephroid.submit(sceneText);
//   for await (const now of nephroid.follow(job.id)) console.log(now.state, now.progress);

/** An answer that was not a success; `problem` is the RFC 9457 document. */
export class NephroidProblem extends Error {
  constructor(problem) {
    super(problem.detail ?? problem.title ?? "The request failed.");
    this.name = "NephroidProblem";
    this.problem = problem;
  }
}

export class Nephroid {
  /** @param {string} base address of the service without a final slash; empty for this page's own */
  constructor(base = "") {
    this.base = base;
  }

  /** Sends a scene (text, or an object to be written as JSON). Resolves with the job once it is on disk. */
  async submit(scene, { idempotencyKey, signal } = {}) {
    const headers = { "Content-Type": "application/json" };
    if (idempotencyKey) headers["Idempotency-Key"] = idempotencyKey;
    return (await this.#send("/v1/renders", { method: "POST", headers, body: textOf(scene), signal })).json();
  }

  /** What would run for a scene, and why. */
  async plan(scene, { signal } = {}) {
    const headers = { "Content-Type": "application/json" };
    return (await this.#send("/v1/plans", { method: "POST", headers, body: textOf(scene), signal })).json();
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
    const answer = await fetch(`${this.base}/v1/renders/${id}/preview.png`, { signal });
    if (answer.status === 409) return null;
    return (await checked(answer)).blob();
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
   * Yields the job whenever it has changed, the last time when it is done. A service that restarts is
   * waited for: the job goes on after it.
   */
  async *follow(id, { signal, interval = 500 } = {}) {
    let tag = null;
    let failures = 0;
    for (;;) {
      try {
        const headers = tag ? { "If-None-Match": tag } : {};
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
      await pause(Math.min(interval * 2 ** failures, 5000), signal);
    }
  }

  async #send(path, options) {
    return checked(await fetch(this.base + path, options));
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

function pause(milliseconds, signal) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(resolve, milliseconds);
    signal?.addEventListener("abort", () => (clearTimeout(timer), reject(signal.reason)), { once: true });
  });
}
