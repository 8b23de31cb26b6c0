// Shows at which stage a diagnosis is, until it has ended.
const stages = document.getElementById("stages"), now = document.getElementById("now"), seconds = document.getElementById("seconds");

async function ask() {
  let state;
  try {
    state = await (await fetch("state")).json();
  } catch {
    now.textContent = "simgap open has ended: start it again";
    return;
  }
  if (state.ended) {
    location.reload();
    return;
  }
  seconds.textContent = Math.round(state.seconds);
  const words = state.stages.map(([, said]) => said), last = words.pop();
  if (last && now.textContent !== last) now.textContent = last; // a screen reader says what changes
  for (const said of words.slice(stages.children.length)) {
    const item = document.createElement("li");
    item.textContent = said;
    stages.append(item);
  }
  setTimeout(ask, 400);
}

const stop = document.getElementById("stop");
stop.addEventListener("click", () => {
  stop.disabled = true;
  fetch("stop", { method: "POST" });
});
stop.disabled = false; // a press before this line would be lost
ask();
