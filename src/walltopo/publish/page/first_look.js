// Follows a scan: shows each new look at the wall, and leads to the page once it is written.
const below = document.body.dataset.below;
const [wall, bar, line] = ["#wall", "progress", "[role=status]"].map((one) => document.querySelector(one));
const LOOKS = { scale: "a rough surface through the matched points", dense: "the mesh", texture: "the mesh with its texture" };
const STAGES = {
  ingest: "reading the photos",
  sparse: "placing the photos",
  scale: "finding scale and up",
  dense: "building the mesh",
  texture: "painting the mesh",
  detect: "finding holds in the photos",
  lift: "carrying the holds onto the mesh",
  propose: "looking for missed holds",
  classify: "naming colours and types",
  routes: "grouping routes",
  edit: "applying corrections",
  export: "writing the page",
  join: "joining with the former wall",
};
const EVERY = 2000; // milliseconds
let shown = "";

function describe({ stages, running, problem, look }) {
  const now = stages.find(({ state }) => state === "running");
  const seen = look ? `You see ${LOOKS[look.split("-")[0]]}.` : "";
  if (now && running) return `${sentence(STAGES[now.name] ?? now.name)} … ${seen}`;
  if (problem) return `The scan stopped: ${problem} ${seen}`;
  if (!running) return `The scan is not running; continue it with walltopo scan. ${seen}`;
  return seen || "Waiting for the scan …";
}

const sentence = (text) => text[0].toUpperCase() + text.slice(1);

function show(look) {
  if (!look || look === shown) return;
  shown = look;
  const element = document.createElement("wall-topo");
  element.setAttribute("src", `${below}wall.glb?look=${encodeURIComponent(look)}`);
  element.setAttribute("heading", document.title);
  wall.replaceChildren(element);
}

async function follow() {
  try {
    const answer = await fetch(`${below}status`);
    if (!answer.ok) throw new Error(await answer.text());
    const status = await answer.json();
    if (status.finished && !status.running) return location.replace("/");
    const done = status.stages.filter(({ state }) => state === "done").length;
    bar.value = done / Math.max(status.stages.length, 1);
    line.textContent = describe(status);
    show(status.look);
  } catch (error) {
    line.textContent = `The server does not answer: is walltopo view still running? (${error.message})`;
  }
  setTimeout(follow, EVERY);
}

void follow();
