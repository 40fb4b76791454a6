// The scene's text: numbered lines, errors at their lines, completion from the schema.

import { completionsAt } from "./complete.js";
import { make } from "./recent.js";

const MOST_ITEMS = 60;

export class Editor {
  #area = byId("scene");
  #gutter = byId("gutter");
  #list = byId("completions");
  #problem = byId("problem");
  #schema = null;
  #open = null; // { from, to, items }
  #chosen = 0;

  /** `edited` is called when the text changes by hand, `submit` by Ctrl + Enter. */
  constructor({ edited, submit }) {
    this.#area.addEventListener("input", (event) => {
      this.clearProblem();
      this.#numberLines();
      edited();
      if (event.inputType?.startsWith("insert") && /["\w]/.test(event.data ?? "")) this.#complete();
      else this.#close();
    });
    this.#area.addEventListener("scroll", () => {
      this.#gutter.scrollTop = this.#area.scrollTop;
      this.#close();
    });
    this.#area.addEventListener("blur", () => this.#close());
    this.#area.addEventListener("keydown", (event) => this.#key(event, submit));
  }

  set schema(schema) {
    this.#schema = schema;
  }

  get text() {
    return this.#area.value;
  }

  set text(text) {
    this.#area.value = text;
    this.#area.scrollTop = this.#area.scrollLeft = 0;
    this.clearProblem();
    this.#numberLines();
  }

  focus() {
    this.#area.focus();
  }

  clearProblem() {
    this.#problem.hidden = true;
    this.#area.removeAttribute("aria-invalid");
  }

  /** Shows a problem; `jump` puts the caret where the first error is. */
  showProblem(error, { jump = true } = {}) {
    const problem = error.problem ?? { title: "The service cannot be reached", detail: error.message };
    const errors = problem.errors ?? [];
    const words = errors.length ? this.#errorList(errors) : make("p", "", problem.detail ?? "");
    this.#problem.replaceChildren(make("strong", "", problem.title), words);
    this.#problem.hidden = false;
    if (!errors.length) return;
    this.#area.setAttribute("aria-invalid", "true");
    const placed = errors.filter((one) => one.line);
    this.#numberLines(new Set(placed.map((one) => one.line)));
    // A name that is misspelt is more to the point than the one that is missed for it.
    if (jump && placed.length) this.#goTo(placed.find((one) => one.code === "unknown_field") ?? placed[0]);
  }

  /** Selects what an error is about: the name or value at its column, or all of its line. */
  #goTo({ line, column = 1 }) {
    const area = this.#area;
    const lines = area.value.split("\n");
    const text = lines[line - 1] ?? "";
    const start = lines.slice(0, line - 1).reduce((sum, one) => sum + one.length + 1, 0);
    const word = /^(?:"(?:[^"\\]|\\.)*"?|[\w.+-]+)/.exec(text.slice(column - 1))?.[0];
    const [from, to] = word ? [column - 1, column - 1 + word.length] : [0, text.length];
    area.focus({ preventScroll: true });
    area.setSelectionRange(start + from, start + to);
    const height = area.scrollHeight / lines.length;
    area.scrollTop = Math.max(0, (line - 1) * height - area.clientHeight / 2);
    const end = this.#widthOf(text.slice(0, word ? to : column - 1));
    area.scrollLeft = end < area.clientWidth - 40 ? 0 : end - area.clientWidth / 2;
    area.scrollIntoView({ block: "nearest" });
  }

  #errorList(errors) {
    const list = make("ul");
    for (const error of errors) {
      const item = make("li");
      if (error.line) {
        const jump = Object.assign(make("button", "jump", `line ${error.line}`), { type: "button" });
        jump.addEventListener("click", () => this.#goTo(error));
        item.append(jump);
      }
      if (error.pointer) item.append(make("code", "", error.pointer));
      item.append(sentence(error.detail));
      list.append(item);
    }
    return list;
  }

  #numberLines(marked = new Set()) {
    const count = this.#area.value.split("\n").length;
    const lines = Array.from({ length: count }, (_, i) => make("span", marked.has(i + 1) ? "wrong" : "", `${i + 1}\n`));
    this.#gutter.replaceChildren(...lines);
    this.#gutter.scrollTop = this.#area.scrollTop;
  }

  // ---- completion

  #key(event, submit) {
    if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) return submit();
    if (event.key === " " && event.ctrlKey) return event.preventDefault(), this.#complete();
    if (!this.#open) return;
    const moves = { ArrowDown: 1, ArrowUp: -1 };
    if (event.key in moves) {
      event.preventDefault();
      this.#choose((this.#chosen + moves[event.key] + this.#open.items.length) % this.#open.items.length);
    } else if (event.key === "Enter" || event.key === "Tab") {
      event.preventDefault();
      this.#accept(this.#chosen);
    } else if (event.key === "Escape") {
      event.preventDefault();
      this.#close();
    } else if (event.key.startsWith("Arrow") || event.key === "Home" || event.key === "End") {
      this.#close();
    }
  }

  #complete() {
    this.#close();
    const found = this.#schema && completionsAt(this.#area.value, this.#area.selectionStart, this.#schema);
    if (!found) return;
    this.#open = { ...found, items: found.items.slice(0, MOST_ITEMS) };
    this.#list.replaceChildren(...this.#open.items.map((item, i) => this.#option(item, i)));
    this.#list.hidden = false;
    this.#area.setAttribute("aria-expanded", "true");
    this.#place();
    this.#choose(0);
  }

  #option(item, index) {
    const option = make("li");
    Object.assign(option, { id: `completion-${index}`, role: "option" });
    option.append(make("span", "word", item.label), make("span", "meaning", item.detail));
    // Not on click: the editor would lose the focus first, and close the list.
    option.addEventListener("pointerdown", (event) => (event.preventDefault(), this.#accept(index)));
    return option;
  }

  /** Puts the list under the caret, within the editor. */
  #place() {
    const area = this.#area;
    const before = area.value.slice(0, this.#open.from).split("\n");
    const style = getComputedStyle(area);
    const line = parseFloat(style.lineHeight);
    const left = area.offsetLeft + parseFloat(style.paddingLeft) + this.#widthOf(before.at(-1)) - area.scrollLeft;
    const top = parseFloat(style.paddingTop) + before.length * line - area.scrollTop;
    const box = this.#list;
    box.style.left = `${Math.max(4, Math.min(left, area.parentElement.clientWidth - box.offsetWidth - 4))}px`;
    const above = top + box.offsetHeight > area.clientHeight && top - line > box.offsetHeight;
    box.style.top = `${above ? top - line - box.offsetHeight : top}px`;
  }

  /** Of a piece of text in the editor, in pixels. */
  #widthOf(text) {
    const ruler = document.createElement("canvas").getContext("2d");
    ruler.font = getComputedStyle(this.#area).font;
    return ruler.measureText(text).width;
  }

  #choose(index) {
    this.#list.children[this.#chosen]?.removeAttribute("aria-selected");
    this.#chosen = index;
    const option = this.#list.children[index];
    option.setAttribute("aria-selected", "true");
    option.scrollIntoView({ block: "nearest" });
    this.#area.setAttribute("aria-activedescendant", option.id);
  }

  #accept(index) {
    const { from, to, items } = this.#open;
    this.#close();
    this.#area.focus();
    this.#area.setRangeText(items[index].insert, from, to, "end");
    this.#area.dispatchEvent(new InputEvent("input", { inputType: "insertReplacementText" }));
  }

  #close() {
    this.#open = null;
    this.#list.hidden = true;
    this.#area.setAttribute("aria-expanded", "false");
    this.#area.removeAttribute("aria-activedescendant");
  }
}

/** What the service wrote between backticks is a name. */
function sentence(words) {
  const span = make("span");
  span.append(...words.split("`").map((part, i) => (i % 2 ? make("code", "", part) : part)));
  return span;
}

const byId = (id) => document.getElementById(id);
