// The light paths of a finished picture, switched on and off: layers are added as light, not as colours.

import { make } from "./recent.js";

/** What each class of paths is, in words. */
const MEANING = {
  emitted: "lamps, seen directly, in mirrors and through glass",
  direct: "light straight from a lamp",
  caustic: "light thrown by mirrors and glass",
  indirect: "light that other surfaces have scattered",
};

export class Layers {
  #group = document.getElementById("layers");
  #canvas = document.getElementById("mix");
  #job = null;
  #on = new Set();
  #pixels = new Map(); // layer → its light, three numbers per pixel
  #turn = 0;

  /** `show(url, words)` puts a whole picture into the frame; null leaves the frame to the mixture. */
  constructor(nephroid, show) {
    this.nephroid = nephroid;
    this.show = show;
  }

  hide() {
    this.#job = null;
    this.#turn += 1;
    this.#group.hidden = true;
    this.#canvas.hidden = true;
    this.#pixels.clear();
  }

  /** Offers the layers of a finished job. */
  offer(job) {
    if (this.#job?.id === job.id) return;
    this.hide();
    this.#job = job;
    const names = Object.keys(job.links).filter((name) => name.startsWith("layer_")).map((name) => name.slice(6));
    this.#on = new Set(names);
    const buttons = names.map((name) => this.#toggle(name));
    if (job.links.error) buttons.push(this.#errorButton());
    this.#group.replaceChildren(...buttons);
    this.#group.hidden = !buttons.length;
    this.show(job.links.image, `The finished picture: ${job.name}`);
  }

  #toggle(name) {
    const button = Object.assign(make("button", "", name), { type: "button", title: MEANING[name] ?? "" });
    button.dataset.layer = name;
    button.addEventListener("click", () => {
      if (!this.#on.delete(name)) this.#on.add(name);
      this.#update();
    });
    button.setAttribute("aria-pressed", "true");
    return button;
  }

  #errorButton() {
    const button = Object.assign(make("button", "map", "error map"), { type: "button" });
    button.title = "Estimated error of each pixel: dark 0.1 %, bright 100 %";
    button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", () => this.#update(button.getAttribute("aria-pressed") === "false"));
    return button;
  }

  async #update(errorMap = false) {
    const turn = (this.#turn += 1);
    const { links, name } = this.#job;
    for (const button of this.#group.children) {
      const { layer } = button.dataset;
      button.setAttribute("aria-pressed", layer ? !errorMap && this.#on.has(layer) : errorMap);
    }
    const all = Object.keys(links).filter((link) => link.startsWith("layer_")).length === this.#on.size;
    this.#canvas.hidden = true;
    if (errorMap) return this.show(links.error, `Estimated error of ${name}: dark is exact, bright is wrong`);
    if (all) return this.show(links.image, `The finished picture: ${name}`);
    const [only] = this.#on;
    if (this.#on.size === 1) return this.show(links[`layer_${only}`], `${only} light of ${name}`);
    const mixed = await this.#mix([...this.#on]);
    if (turn !== this.#turn) return;
    this.#canvas.width = mixed.width;
    this.#canvas.height = mixed.height;
    this.#canvas.getContext("2d").putImageData(mixed, 0, 0);
    this.#canvas.setAttribute("aria-label", this.#on.size ? `${[...this.#on].join(" and ")} light of ${name}` : "No light");
    this.show(null);
    this.#canvas.hidden = false;
  }

  /** The sum of some layers. Where a layer is white it may have been brighter: there the sum is too dark. */
  async #mix(names) {
    const { width, height } = this.#job;
    const tone = await this.#tone();
    const layers = await Promise.all(names.map((name) => this.#light(name, tone)));
    const mixed = new ImageData(width, height);
    for (let i = 0, k = 0; i < mixed.data.length; i += 1) {
      if (i % 4 === 3) mixed.data[i] = 255;
      else mixed.data[i] = tone.encode(layers.reduce((sum, layer) => sum + layer[k], 0)), (k += 1);
    }
    return mixed;
  }

  async #light(name, tone) {
    if (!this.#pixels.has(name)) {
      const image = new Image();
      image.src = this.#job.links[`layer_${name}`];
      await image.decode();
      const canvas = new OffscreenCanvas(image.naturalWidth, image.naturalHeight);
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
      const table = Float32Array.from({ length: 256 }, (_, code) => tone.decode(code));
      this.#pixels.set(name, Float32Array.from(data.filter((_, i) => i % 4 !== 3), (code) => table[code]));
    }
    return this.#pixels.get(name);
  }

  async #tone() {
    const scene = JSON.parse(await this.nephroid.scene(this.#job.id));
    return TONES[scene.image?.tone] ?? TONES.linear;
  }
}

const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
const toDisplay = (x) => 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(x, 1) ** (1 / 2.4) - 0.055);

/** Between codes of a picture and light, for each tone that a scene may ask for. */
const TONES = {
  linear: { decode: (code) => toLinear(code / 255), encode: toDisplay },
  filmic: {
    // y = x (a x + b) / (x (c x + d) + e), solved for x.
    decode: (code) => {
      const y = Math.min(toLinear(code / 255), 0.999);
      const [a, b, c] = [2.51 - 2.43 * y, 0.03 - 0.59 * y, -0.14 * y];
      return (-b + Math.sqrt(b * b - 4 * a * c)) / (2 * a);
    },
    encode: (x) => toDisplay((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)),
  },
};
