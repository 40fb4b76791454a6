// The light paths of a finished picture, switched on and off: layers are added as light, not as colours.

import { readExr } from "./exr.js";
import { make } from "./recent.js";

/** What each class of paths is, in words. The classes add up to the picture; other layers are parts of them. */
const MEANING = {
  emitted: "lamps, seen directly, in mirrors and through glass",
  direct: "light straight from a lamp",
  caustic: "light thrown by mirrors and glass",
  indirect: "light that other surfaces have scattered",
};

const ERROR_MAP = "Estimated error of each pixel: dark 0.1 % or less, bright 100 %.";

export class Layers {
  #group = document.getElementById("layers");
  #canvas = document.getElementById("mix");
  #words = document.getElementById("layer-words");
  #job = null;
  #classes = [];
  #on = new Set(); // of the classes
  #alone = null; // the link of what is shown by itself instead
  #light = new Map(); // class → a promise of its light, three numbers per pixel
  #display = null; // a promise of what makes numbers of a display of light
  #turn = 0;

  /** `show(url, words)` puts a whole picture into the frame; null leaves the frame to the mixture. */
  constructor(nephroid, { show, failed }) {
    this.nephroid = nephroid;
    this.show = show;
    this.failed = failed;
  }

  hide() {
    this.#job = null;
    this.#turn += 1;
    this.#group.hidden = true;
    this.#words.hidden = true;
    this.#canvas.hidden = true;
    this.#light.clear();
    this.#display = null;
  }

  /** Offers the layers of a finished job. */
  offer(job) {
    if (this.#job?.id === job.id) return;
    this.hide();
    this.#job = job;
    const names = Object.keys(job.links).filter((link) => link.startsWith("layer_")).map((link) => link.slice(6));
    this.#classes = Object.keys(MEANING).filter((name) => names.includes(name));
    this.#on = new Set(this.#classes);
    this.#alone = null;
    const named = names.filter((name) => !this.#classes.includes(name));
    const buttons = this.#classes.map((name) => this.#switch(name));
    buttons.push(...named.map((name) => this.#single(`layer_${name}`, name, "A layer that the scene names, by itself")));
    if (job.links.error) buttons.push(this.#single("error", "error map", ERROR_MAP));
    buttons.find((button) => button.dataset.alone)?.classList.add("first-alone");
    this.#group.replaceChildren(...buttons);
    this.#group.hidden = !buttons.length;
    this.#words.hidden = !buttons.length;
    this.#update();
  }

  /** Switches a class on and off. */
  #switch(name) {
    const button = Object.assign(make("button", "", name), { type: "button", title: MEANING[name] });
    button.dataset.layer = name;
    button.addEventListener("click", () => {
      if (!this.#alone && !this.#on.delete(name)) this.#on.add(name);
      this.#alone = null;
      this.#update();
    });
    return button;
  }

  /** Shows something by itself, and the picture again. */
  #single(link, words, title) {
    const button = Object.assign(make("button", "", words), { type: "button", title });
    button.dataset.alone = link;
    button.addEventListener("click", () => {
      this.#alone = this.#alone === link ? null : link;
      this.#update();
    });
    return button;
  }

  #update() {
    const turn = (this.#turn += 1);
    for (const button of this.#group.children) {
      const { layer, alone } = button.dataset;
      button.setAttribute("aria-pressed", layer ? !this.#alone && this.#on.has(layer) : alone === this.#alone);
    }
    this.#words.textContent = this.#meaning();
    const { links, name } = this.#job;
    if (this.#alone) return this.#whole(links[this.#alone], this.#alone === "error" ? `Estimated error of ${name}: dark is exact, bright is wrong` : `${this.#alone.slice(6)} of ${name}`);
    if (this.#on.size === this.#classes.length) return this.#whole(links.image, `The finished picture: ${name}`);
    const on = this.#classes.filter((layer) => this.#on.has(layer));
    const draw = (mixed) => turn === this.#turn && this.#draw(mixed, on);
    const fail = (error) => (this.#light.clear(), turn === this.#turn && this.failed(error));
    this.#mix(on).then(draw, fail);
  }

  /** What the frame shows, in words. */
  #meaning() {
    if (this.#alone === "error") return ERROR_MAP;
    if (this.#alone) return `Only ${this.#alone.slice(6)}, a layer that the scene names.`;
    if (this.#on.size === this.#classes.length) return "All light. Each kind of light path can be switched off and on.";
    const on = this.#classes.filter((layer) => this.#on.has(layer));
    return on.length ? `Only ${on.map((layer) => `${layer}: ${MEANING[layer]}`).join("; ")}.` : "All light is switched off.";
  }

  #whole(url, words) {
    this.#canvas.hidden = true;
    this.show(url, words);
  }

  #draw(mixed, on) {
    Object.assign(this.#canvas, { width: mixed.width, height: mixed.height });
    this.#canvas.getContext("2d").putImageData(mixed, 0, 0);
    this.#canvas.setAttribute("aria-label", on.length ? `${on.join(" and ")} light of ${this.#job.name}` : "No light");
    this.show(null);
    this.#canvas.hidden = false;
  }

  /** The sum of some classes, as the service would show it. */
  async #mix(names) {
    const { width, height } = this.#job;
    const toDisplay = await (this.#display ??= this.#develops());
    const layers = await Promise.all(names.map((name) => this.#lightOf(name)));
    const mixed = new ImageData(width, height);
    for (let i = 0, k = 0; i < mixed.data.length; i += 4, k += 3) {
      for (let c = 0; c < 3; c += 1) {
        let sum = 0;
        for (const light of layers) sum += light[k + c];
        mixed.data[i + c] = toDisplay(sum);
      }
      mixed.data[i + 3] = 255;
    }
    return mixed;
  }

  #lightOf(name) {
    if (!this.#light.has(name)) {
      const file = this.nephroid.picture(this.#job.id, `layers/${name}.exr`);
      this.#light.set(name, file.then((blob) => blob.arrayBuffer()).then(readExr).then(({ light }) => light));
    }
    return this.#light.get(name);
  }

  async #develops() {
    const { image = {} } = JSON.parse(await this.nephroid.scene(this.#job.id));
    const gain = 2 ** (image.exposure ?? 0);
    const tone = image.tone === "filmic" ? filmic : (x) => x;
    return (light) => encode(tone(light * gain));
  }
}

/** The fit of the ACES curve by Narkowicz, as the service has it. */
function filmic(light) {
  const x = Math.min(Math.max(light, 0), 1e6);
  return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

/** From linear to the codes of sRGB; the canvas rounds and clips. */
const encode = (x) => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
