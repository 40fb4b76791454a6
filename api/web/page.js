// The web page: pick or edit a scene, render it, watch, keep the picture.

import { Nephroid } from "./nephroid.js";
import { Editor } from "./editor.js";
import { Layers } from "./layers.js";
import { drawSketch } from "./sketch.js";
import { drawErrorChart } from "./chart.js";
import { RecentRenders, WORDS, make, titled } from "./recent.js";

/** A scene that rests this long is checked. */
const CHECK_AFTER = 700;

const nephroid = new Nephroid();
const $ = (id) => document.getElementById(id);

const editor = new Editor({ edited: sceneEdited, submit: submitScene });
const layers = new Layers(nephroid, { show, failed: showProblem });
const recent = new RecentRenders(nephroid, {
  shown: () => following?.id,
  removed: (id) => id === following?.id && showScene(),
  failed: showProblem,
});

let following = null; // { id, stop }
let chosen = null; // the sample in the editor, as long as it is not changed
let shownUrl = null;

start();

async function start() {
  $("scene-form").addEventListener("submit", (event) => (event.preventDefault(), submitScene()));
  $("plan").addEventListener("click", showPlan);
  // Not by its address, which names the job in the frame.
  document.querySelector(".skip").addEventListener("click", (event) => (event.preventDefault(), editor.focus()));
  $("cancel").addEventListener("click", () => following && nephroid.cancel(following.id).then(showJob, showProblem));
  $("reuse").addEventListener("click", reuseScene);
  $("key-form").addEventListener("submit", signIn);
  window.addEventListener("hashchange", followAddress);
  await askForKey().catch(showProblem);
  recent.start();
  nephroid.schema().then((schema) => (editor.schema = schema), () => {}); // without it there is no completion
  await loadSamples().catch(showProblem);
  followAddress();
}

/** Resolves once this client may use the service. */
async function askForKey() {
  const { welcome } = await nephroid.session();
  if (welcome) return;
  $("key-dialog").showModal();
  await new Promise((resolve) => $("key-dialog").addEventListener("close", resolve, { once: true }));
}

async function signIn(event) {
  event.preventDefault();
  try {
    await nephroid.signIn($("key").value.trim());
    $("key-dialog").close();
  } catch (error) {
    $("key-problem").textContent = error.message;
    $("key").focus();
  }
}

// ---- the scene

async function loadSamples() {
  const samples = await nephroid.samples();
  const texts = await Promise.all(samples.map((sample) => nephroid.sample(sample.name)));
  samples.forEach((sample, i) => $("samples").append(card(sample, texts[i])));
  const first = Math.max(0, samples.findIndex((sample) => sample.name === "glass-ball"));
  if (!samples.length || editor.text) return;
  const input = $("samples").querySelectorAll("input")[first];
  input.checked = true;
  input.closest(".card").scrollIntoView({ block: "nearest", inline: "center" });
  setScene(texts[first]);
  chosen = samples[first];
}

function card(sample, text) {
  const label = Object.assign(make("label", "card"), { title: sample.title });
  const input = Object.assign(make("input"), { type: "radio", name: "sample", value: sample.name });
  input.addEventListener("change", () => chooseSample(sample, text));
  label.append(input, sample.picture ? pictureOf(sample) : sketchOf(text), make("span", "card-title", titled(sample.title)));
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
  editor.text = text;
  $("edited").hidden = true;
  chosen = null;
}

let resting;
function sceneEdited() {
  $("edited").hidden = false;
  chosen = null;
  clearTimeout(resting);
  resting = setTimeout(() => (following || showScene(), checkScene()), CHECK_AFTER);
}

/** Has the service look at what is being typed, without moving anything. */
async function checkScene() {
  const text = editor.text;
  const wrong = await nephroid.plan(text).then(() => null, (error) => error);
  if (wrong && text === editor.text) editor.showProblem(wrong, { jump: false });
}

/** What the frame shows while no job is followed: the sample's picture, or the outline of what is edited. */
function showScene() {
  if (location.hash) history.replaceState(null, "", location.pathname);
  following?.stop.abort();
  following = null;
  layers.hide();
  for (const id of ["progress", "cancel", "reuse", "download", "download-exr", "download-chart", "plan-box"]) $(id).hidden = true;
  drawErrorChart($("chart"), []);
  for (const id of ["rounds", "error", "time"]) $(id).textContent = "–";
  const scene = parsed(editor.text);
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

async function submitScene() {
  clearTimeout(resting);
  editor.clearProblem();
  $("submit").disabled = true;
  try {
    const job = await nephroid.submit(editor.text);
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
    editor.focus();
  } catch (error) {
    showProblem(error);
  }
}

async function showPlan() {
  editor.clearProblem();
  try {
    fillPlan(await nephroid.plan(editor.text));
    $("plan-box").open = true;
    $("plan-box").scrollIntoView({ block: "nearest" });
  } catch (error) {
    showProblem(error);
  }
}

function showProblem(error) {
  editor.showProblem(error);
}

// ---- the picture

function followAddress() {
  const id = location.hash.slice(1);
  following?.stop.abort();
  following = null;
  if (!/^[0-9a-f-]{36}$/.test(id)) return showScene();
  following = { id, stop: new AbortController() };
  layers.hide();
  show(null);
  follow(following).catch((error) => error.name === "AbortError" || lostJob(error));
}

async function follow(current) {
  const { id, stop } = current;
  let seen = 0;
  let state = "";
  for await (const job of nephroid.follow(id, { signal: stop.signal, interval: 1000 })) {
    if (current !== following) return;
    showJob(job);
    if (job.state !== state) recent.refresh();
    state = job.state;
    if (state === "running" && job.rounds > seen) {
      seen = job.rounds;
      const blob = await nephroid.preview(id, { signal: stop.signal });
      if (blob && current === following) await show(URL.createObjectURL(blob), `The picture after ${seen} rounds`, seen);
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
  drawErrorChart($("chart"), job.history ?? []);
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
  const { image, exr, chart } = job.links;
  const downloads = [["download", image, "png"], ["download-exr", exr, "exr"], ["download-chart", image && chart, "svg"]];
  for (const [id, href, kind] of downloads) {
    $(id).hidden = !href;
    if (href) Object.assign($(id), { href, download: `${slug(job.name)}.${kind}` });
  }
  if (image) layers.offer(job);
}

/** Puts a picture into the frame once it is decoded; null brings the outline back. */
async function show(url, words = "", rounds = "") {
  const image = $("image");
  if (shownUrl?.startsWith("blob:")) URL.revokeObjectURL(shownUrl);
  shownUrl = url;
  image.hidden = !url;
  image.dataset.rounds = rounds;
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
  const all = plan.decisions ?? [];
  const groups = [[["Runs", "how", "because"], true], [["Left out", "instead", "because"], false]];
  const rows = groups.flatMap(([words, runs]) => {
    const some = all.filter((decision) => decision.runs === runs);
    return some.length ? [groupRow(words), ...some.map(decisionRow)] : [];
  });
  $("decisions").replaceChildren(...rows);
  $("warnings").replaceChildren(...(plan.warnings ?? []).map((warning) => make("li", "", warning.message)));
  $("plan-box").hidden = false;
}

function groupRow(words) {
  const row = make("tr", "group");
  row.append(...words.map((word) => Object.assign(make("th", "", word), { scope: "col" })));
  return row;
}

function decisionRow({ topic, choice, reason, runs }) {
  const row = make("tr", runs ? "" : "left-out");
  row.append(Object.assign(make("th", "", topic), { scope: "row" }), make("td", "", choice), make("td", "", reason));
  return row;
}

// ---- words and elements

const percent = (fraction) => `${(100 * fraction).toPrecision(2)} %`;
const slug = (name) => name.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "") || "render";

function elapsed(job) {
  const end = job.finished_at ? Date.parse(job.finished_at) : Date.now();
  return `${Math.max(0, (end - Date.parse(job.started_at)) / 1000).toFixed(1)} s`;
}
