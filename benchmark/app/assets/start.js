// Takes dropped or chosen files or a folder, sends it to the server on this machine and opens its page.
const drop = document.getElementById("drop"), said = document.getElementById("said");
const largest = Number(drop.dataset.largest);

// [[path, File], ...] of what was dropped; what is hidden, such as .git, stays behind.
async function walk(entry, path = entry.name) {
  if (entry.isFile) return [[path, await new Promise((found, failed) => entry.file(found, failed))]];
  const reader = entry.createReader(), files = [];
  for (;;) { // a reader gives some of a folder at a time
    const some = await new Promise((found, failed) => reader.readEntries(found, failed));
    if (!some.length) return files;
    for (const one of some) if (!one.name.startsWith(".")) files.push(...await walk(one, `${path}/${one.name}`));
  }
}

async function refusalOf(answer) {
  const text = await answer.text();
  try { return JSON.parse(text).refused; } catch { return text || `the server said ${answer.status}`; }
}

async function send(files) {
  if (!files.length) throw new Error("there is no file in it");
  const top = new Set(files.map(([path]) => path.split("/")[0]));
  if (top.size > 1 && files.some(([path]) => path.includes("/"))) throw new Error("drop one folder at a time, or files alone");
  if (top.size > 1) files = files.map(([path, file]) => [`${top.size} logs/${path}`, file]);
  const size = files.reduce((sum, [, file]) => sum + file.size, 0), name = files[0][0].split("/")[0];
  if (size > largest) throw new Error(`${name} has ${Math.round(size / 1e6)} MB and this page takes ${largest / 1e6} MB: cut the record, or give it on the command line, where there is no limit: simgap open ${name}`);
  const { key } = await (await fetch("records", { method: "POST" })).json();
  let sent = 0;
  for (const [path, file] of files) {
    said.textContent = `Reading ${name}, ${Math.round(100 * sent / Math.max(size, 1))} %`;
    const answer = await fetch(`records/${key}/files/${path.split("/").map(encodeURIComponent).join("/")}`, { method: "PUT", body: file });
    if (!answer.ok) throw new Error(await refusalOf(answer));
    sent += file.size;
  }
  said.textContent = `Looking into ${name}`;
  location.href = `records/${key}/`;
}

async function take(collect) {
  said.className = "";
  try {
    await send(await collect());
  } catch (error) {
    said.className = "alert";
    said.textContent = error instanceof TypeError ? "simgap open has ended: start it again" : error.message;
  }
}

document.getElementById("file").addEventListener("change", (event) => take(() => [...event.target.files].map((file) => [file.name, file])));
document.getElementById("folder").addEventListener("change", (event) => take(() => [...event.target.files]
  .map((file) => [file.webkitRelativePath, file]).filter(([path]) => !path.split("/").some((part) => part.startsWith(".")))));
addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
addEventListener("dragleave", () => drop.classList.remove("over"));
addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over");
  // Both are gone once this function has returned; what comes from another program may be no entry of a disk.
  const items = [...event.dataTransfer.items].map((item) => [item.webkitGetAsEntry(), item.getAsFile()]);
  take(async () => (await Promise.all(items.map(([entry, file]) => (entry ? walk(entry) : file ? [[file.name, file]] : [])))).flat());
});
addEventListener("pageshow", () => { said.textContent = ""; document.querySelectorAll("input").forEach((input) => { input.value = ""; }); });
