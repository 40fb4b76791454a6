// The web page: pick or edit a scene, render it, watch, keep the picture.

import { Nephroid } from "./nephroid.js";
import { drawSketch } from "./sketch.js";
import { drawErrorChart } from "./chart.js";
import { RecentRenders, WORDS, make } from "./recent.js";

const nephroid = new Nephroid();
const $ = (id) => document.getElementById(id);

const recent = new RecentRenders(nephroid, {
  shown: () => following?.id,
  removed: (id) => id === following?.id && showScene(),
  failed: showProblem,
});

let following = null; // { id, stop, history }
let chosen = null; // the sample in the editor, as long as it is not changed
let shownUrl = null;

start();

async function start() {
  $("scene-form").addEventListener("submit", (event) => (event.preventDefault(), submitScene()));
  $("plan").addEventListener("click", showPlan);
  $("cancel").addEventListener("click", () => following && nephroid.cancel(following.id).then(showJob, showProblem));
  $("reuse").addEventListener("click", reuseScene);
  $("scene").addEventListener("input", sceneEdited);
  $("scene").addEventListener("scroll", () => ($("gutter").scrollTop = $("scene").scrollTop));
  $("scene").addEventListener("keydown", (event) => {
    if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) submitScene();
  });
  window.addEventListener("hashchange", followAddress);
  recent.start();
  await loadSamples().catch(showProblem);
  followAddress();
}

// ---- the scene

async function loadSamples() {
  const samples = await nephroid.samples();
  const texts = await Promise.all(samples.map((sample) => nephroid.sample(sample.name)));
  samples.forEach((sample, i) => $("samples").append(card(sample, texts[i])));
  const first = Math.max(0, samples.findIndex((sample) => sample.name === "glass-ball"));
  if (!samples.length || $("scene").value) return;
  $("samples").querySelectorAll("input")[first].checked = true;
  chooseSample(samples[first], texts[first]);
}

function card(sample, text) {
  const label = make("label", "card");
  const input = Object.assign(make("input"), { type: "radio", name: "sample", value: sample.name });
  input.addEventListener("change", () => chooseSample(sample, text));
  label.append(input, sample.picture ? pictureOf(sample) : sketchOf(text), make("span", "card-title", sample.title));
  return label;
}

function pictureOf(sample) {
  return Object.assign(make("img"), { src: sample.picture, alt: "", width: 400, height: 300 });
}

function sketchOf(text) {
  const sketch = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  sketch.setAttribute("aria-hidden", "true");
  drawSketch(sketch, parsed(text));
  return sketch;
}

function chooseSample(sample, text) {
  setScene(text);
  chosen = sample;
  showScene();
}

function setScene(text) {
  $("scene").value = text;
  $("scene").scrollTop = 0;
  $("edited").hidden = true;
  chosen = null;
  clearProblem();
  numberLines();
}

let redrawing;
function sceneEdited() {
  $("edited").hidden = false;
  chosen = null;
  clearProblem();
  numberLines();
  clearTimeout(redrawing);
  redrawing = setTimeout(() => following || showScene(), 150);
}

/** What the frame shows while no job is followed: the sample's picture, or the outline of what is edited. */
function showScene() {
  if (location.hash) history.replaceState(null, "", location.pathname);
  following?.stop.abort();
  following = null;
  for (const id of ["layers", "progress", "cancel", "reuse", "download", "download-exr", "plan-box"]) $(id).hidden = true;
  drawErrorChart($("chart"), []);
  for (const id of ["rounds", "error", "time"]) $(id).textContent = "–";
  const scene = parsed($("scene").value);
  if (scene) {
    const { width = 640, height = 480 } = scene.image ?? {};
    $("size").textContent = `${width} × ${height}`;
    shapeFrame(width, height);
    drawSketch($("sketch"), scene);
  }
  const picture = chosen?.picture ?? null;
  show(picture, picture ? `What ${chosen.title} looks like` : "");
  setState("sketch", picture ? "sample" : "outline");
  const hidden = JSON.stringify(scene?.objects ?? []).includes('"asset"') ? " Meshes from files are not outlined." : "";
  $("said").textContent = picture
    ? "This sample as it looks when it is done. “Render” makes your own."
    : `Outline through the scene's camera.${hidden} “Render” makes the picture.`;
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return null; // half-typed; the service says what is wrong when it is asked to render
  }
}

function numberLines(marked = new Set()) {
  const count = $("scene").value.split("\n").length;
  const lines = Array.from({ length: count }, (_, i) => {
    const line = make("span", marked.has(i + 1) ? "wrong" : "", `${i + 1}\n`);
    return line;
  });
  $("gutter").replaceChildren(...lines);
  $("gutter").scrollTop = $("scene").scrollTop;
}

async function submitScene() {
  clearProblem();
  $("submit").disabled = true;
  try {
    const job = await nephroid.submit($("scene").value);
    location.hash = job.id;
    if (matchMedia("(max-width: 60rem)").matches) $("picture-title").scrollIntoView({ block: "start" });
    recent.refresh();
  } catch (error) {
    showProblem(error);
  } finally {
    $("submit").disabled = false;
  }
}

/** Puts the scene of the job in the frame into the editor. */
async function reuseScene() {
  try {
    setScene(await nephroid.scene(following.id));
    for (const sample of $("samples").querySelectorAll("input")) sample.checked = false;
    $("scene").focus();
  } catch (error) {
    showProblem(error);
  }
}

async function showPlan() {
  clearProblem();
  try {
    fillPlan(await nephroid.plan($("scene").value));
    $("plan-box").open = true;
    $("plan-box").scrollIntoView({ block: "nearest" });
  } catch (error) {
    showProblem(error);
  }
}

function clearProblem() {
  $("problem").hidden = true;
  $("scene").removeAttribute("aria-invalid");
}

function showProblem(error) {
  const problem = error.problem ?? { title: "The service cannot be reached", detail: error.message };
  const box = $("problem");
  box.replaceChildren(make("strong", "", problem.title));
  const errors = problem.errors ?? [];
  if (!errors.length) box.append(make("p", "", problem.detail ?? ""));
  else box.append(errorList(errors));
  box.hidden = false;
  const lines = errors.map((one) => one.line).filter(Boolean);
  if (!errors.length) return;
  $("scene").setAttribute("aria-invalid", "true");
  numberLines(new Set(lines));
  if (lines.length) selectLine(errors.find((one) => one.line).line);
}

function errorList(errors) {
  const list = make("ul");
  for (const error of errors) {
    const item = make("li");
    if (error.line) {
      const jump = make("button", "jump", `line ${error.line}`);
      jump.type = "button";
      jump.addEventListener("click", () => selectLine(error.line));
      item.append(jump);
    }
    if (error.pointer) item.append(make("code", "", error.pointer));
    item.append(make("span", "", error.detail));
    list.append(item);
  }
  return list;
}

function selectLine(number) {
  const area = $("scene");
  const lines = area.value.split("\n");
  const start = lines.slice(0, number - 1).reduce((sum, line) => sum + line.length + 1, 0);
  area.focus({ preventScroll: true });
  area.setSelectionRange(start, start + (lines[number - 1]?.length ?? 0));
  const height = area.scrollHeight / lines.length;
  area.scrollTop = Math.max(0, (number - 1) * height - area.clientHeight / 2);
  area.scrollIntoView({ block: "nearest" });
}

// ---- the picture

function followAddress() {
  const id = location.hash.slice(1);
  following?.stop.abort();
  following = null;
  if (!/^[0-9a-f-]{36}$/.test(id)) return showScene();
  following = { id, stop: new AbortController(), history: [] };
  show(null);
  follow(following).catch((error) => error.name === "AbortError" || lostJob(error));
}

async function follow(current) {
  const { id, stop, history } = current;
  let seen = 0;
  let state = "";
  for await (const job of nephroid.follow(id, { signal: stop.signal, interval: 400 })) {
    if (current !== following) return;
    const last = history.at(-1)?.rounds ?? 0;
    if (job.error_estimate && job.rounds > last) {
      history.push({ rounds: job.rounds, error: job.error_estimate });
    }
    showJob(job);
    if (job.state !== state) recent.refresh();
    state = job.state;
    if (state === "running" && job.rounds > seen) {
      seen = job.rounds;
      const blob = await nephroid.preview(id, { signal: stop.signal });
      if (blob && current === following) await show(URL.createObjectURL(blob), "The picture so far");
    }
  }
}

function lostJob(error) {
  following = null;
  showScene();
  showProblem(error);
}

function showJob(job) {
  if (job.id !== following?.id) return;
  setState(job.state, WORDS[job.state]);
  shapeFrame(job.width, job.height);
  $("progress").hidden = job.done;
  if (job.state === "queued") $("progress").removeAttribute("value");
  else $("progress").value = job.progress;
  $("cancel").hidden = job.done;
  $("reuse").hidden = false;
  $("rounds").textContent = job.rounds || "–";
  $("error").textContent = job.error_estimate ? percent(job.error_estimate) : "–";
  $("time").textContent = job.started_at ? elapsed(job) : "–";
  $("size").textContent = `${job.width} × ${job.height}`;
  $("said").textContent = sentence(job);
  drawErrorChart($("chart"), following.history);
  if (job.plan) fillPlan(job.plan);
  showLinks(job);
}

function sentence(job) {
  switch (job.state) {
    case "queued":
      return job.queue_position ? `${job.queue_position} before it in the queue.` : "Next in the queue.";
    case "running":
      return job.rounds ? `${Math.round(job.progress * 100)} % done.` : "First round; a picture comes with it.";
    case "succeeded":
      return `Finished: ${stopWords(job.stop_reason)}.`;
    case "failed":
      return `Failed: ${job.error?.detail ?? "no reason is known"}`;
    default:
      return "Cancelled. What you may see of it here is not kept.";
  }
}

function stopWords(reason) {
  const words = {
    error: "the error asked for is reached",
    seconds: "the time is used up",
    rounds: "all rounds are done",
    exact: "nothing in it is sampled, one round is exact",
  };
  return words[reason] ?? reason;
}

function showLinks(job) {
  const { image, exr } = job.links;
  for (const [id, href, kind] of [["download", image, "png"], ["download-exr", exr, "exr"]]) {
    $(id).hidden = !href;
    if (href) Object.assign($(id), { href, download: `${slug(job.name)}.${kind}` });
  }
  const layers = Object.entries(job.links).filter(([name]) => name.startsWith("layer_"));
  $("layers").hidden = !layers.length;
  if (!image || $("layers").dataset.job === job.id && $("image").dataset.job === job.id) return;
  $("layers").dataset.job = job.id;
  const all = [["all paths", image], ...layers.map(([name, href]) => [name.slice(6), href])];
  $("layers").replaceChildren(...all.map(([name, href], i) => layerButton(name, href, i === 0, job)));
  show(image, `The finished picture: ${job.name}`, job.id);
}

function layerButton(name, href, pressed, job) {
  const button = Object.assign(make("button", "", name), { type: "button" });
  button.setAttribute("aria-pressed", pressed);
  button.addEventListener("click", () => {
    for (const other of $("layers").children) other.setAttribute("aria-pressed", other === button);
    show(href, `${name} of ${job.name}`, job.id);
  });
  return button;
}

/** Puts a picture into the frame once it is decoded; null brings the outline back. */
async function show(url, words = "", job = "") {
  const image = $("image");
  if (shownUrl?.startsWith("blob:")) URL.revokeObjectURL(shownUrl);
  shownUrl = url;
  image.hidden = !url;
  image.dataset.job = job;
  $("sketch").classList.toggle("under", Boolean(url));
  if (!url) return image.removeAttribute("src");
  const next = new Image();
  next.src = url;
  await next.decode().catch(() => {});
  if (shownUrl === url) Object.assign(image, { src: url, alt: words });
}

function shapeFrame(width, height) {
  $("frame").style.aspectRatio = `${width} / ${height}`;
  $("frame").style.setProperty("--most", `${Math.round((28 * width) / height)}rem`);
}

function setState(state, words) {
  $("state").dataset.state = state;
  $("state").textContent = words;
  document.title = state === "running" ? `Rendering… Nephroid` : "Nephroid: caustics on demand";
}

function fillPlan(plan) {
  const rows = (plan.decisions ?? []).map((decision) => {
    const row = make("tr", decision.runs ? "" : "left-out");
    row.append(make("th", "", decision.topic), make("td", "", decision.choice), make("td", "", decision.reason));
    row.firstChild.scope = "row";
    return row;
  });
  $("decisions").replaceChildren(...rows);
  $("warnings").replaceChildren(...(plan.warnings ?? []).map((warning) => make("li", "", warning.message)));
  $("plan-box").hidden = false;
}

// ---- words and elements

const percent = (fraction) => `${(100 * fraction).toPrecision(2)} %`;
const slug = (name) => name.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "") || "render";

function elapsed(job) {
  const end = job.finished_at ? Date.parse(job.finished_at) : Date.now();
  return `${Math.max(0, (end - Date.parse(job.started_at)) / 1000).toFixed(1)} s`;
}
