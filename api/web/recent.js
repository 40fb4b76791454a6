// The list of recent renders: kept up to date while somebody looks at the page.

const INTERVAL = 3000;
const MOST = 100;

/** The states of a job as people read them. */
export const WORDS = { queued: "queued", running: "rendering", succeeded: "done", failed: "failed", cancelled: "cancelled" };

export class RecentRenders {
  #nephroid;
  #page;
  #length = 8;

  /** `page` says which job is shown, and hears of jobs that were removed and of what failed. */
  constructor(nephroid, page) {
    this.#nephroid = nephroid;
    this.#page = page;
  }

  start() {
    byId("more").addEventListener("click", () => ((this.#length += 16), this.refresh()));
    document.addEventListener("visibilitychange", () => document.hidden || this.refresh());
    setInterval(() => document.hidden || this.refresh(), INTERVAL);
    this.refresh();
  }

  async refresh() {
    let page;
    try {
      page = await this.#nephroid.list({ limit: Math.min(this.#length, MOST) });
    } catch {
      return; // the next turn tries again
    }
    byId("no-jobs").hidden = page.renders.length > 0;
    byId("more").hidden = !page.next_cursor || this.#length >= MOST;
    const known = new Map([...byId("jobs").children].map((item) => [item.dataset.id, item]));
    replaceItems(byId("jobs"), page.renders.map((job) => this.#item(job, known.get(job.id))));
  }

  #item(job, known) {
    const shown = job.id === this.#page.shown();
    const version = JSON.stringify([job.state, Math.round(job.progress * 100), shown]);
    if (known?.dataset.version === version) return known;
    const item = make("li");
    Object.assign(item.dataset, { id: job.id, version });
    item.append(linkTo(job, shown), this.#removeButton(job));
    return item;
  }

  #removeButton(job) {
    const button = Object.assign(make("button", "remove", "×"), { type: "button" });
    button.setAttribute("aria-label", `${job.done ? "Delete" : "Cancel and delete"} ${job.name || "unnamed scene"}`);
    button.title = job.done ? "Delete" : "Cancel and delete";
    button.addEventListener("click", async () => {
      await this.#nephroid.remove(job.id).catch(this.#page.failed);
      this.#page.removed(job.id);
      this.refresh();
    });
    return button;
  }
}

/** Changes the list only where it differs, and leaves the keyboard where it was. */
function replaceItems(list, items) {
  const same = items.length === list.children.length && items.every((item, i) => item === list.children[i]);
  if (same) return;
  const focused = list.contains(document.activeElement) ? document.activeElement : null;
  const [id, tag] = [focused?.closest("li").dataset.id, focused?.tagName];
  list.replaceChildren(...items);
  if (focused) items.find((item) => item.dataset.id === id)?.querySelector(tag).focus({ preventScroll: true });
}

function linkTo(job, shown) {
  const link = Object.assign(make("a"), { href: `#${job.id}` });
  if (shown) link.setAttribute("aria-current", "true");
  const picture = make("span", "thumb");
  if (job.links.image) {
    picture.append(Object.assign(make("img"), { src: job.links.image, alt: "", loading: "lazy" }));
  }
  const progress = job.state === "running" ? ` ${Math.round(job.progress * 100)} %` : "";
  const state = make("span", "state", WORDS[job.state] + progress);
  state.dataset.state = job.state;
  const words = make("span", "job-words");
  words.append(make("span", "job-name", titled(job.name || "unnamed scene")),
               make("span", "quiet", `${when(job.created_at)} · ${job.width} × ${job.height}`), state);
  link.append(picture, words);
  return link;
}

const byId = (id) => document.getElementById(id);

/** An element with a class and a text, if there are any. */
export function make(tag, className = "", text = "") {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text) element.textContent = text;
  return element;
}

/** A name as a title begins. */
export const titled = (name) => name.charAt(0).toUpperCase() + name.slice(1);

function when(time) {
  const date = new Date(time);
  const today = date.toDateString() === new Date().toDateString();
  return today ? date.toLocaleTimeString() : date.toLocaleDateString();
}
