"use strict";
// Stands in for plotly.js while a page of a diagnosis is read: its plots are drawn when they are about to be seen.
(() => {
  const source = document.currentScript.dataset.plotly;
  const fingers = matchMedia("(pointer: coarse)").matches; // they scroll the page and do not zoom
  const waiting = new Map();
  window.Plotly = { newPlot: (name, ...rest) => waiting.set(name, rest) };

  let loading;
  const plotly = () => (loading ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.onload = () => resolve(window.Plotly);
    script.onerror = () => reject(new Error(`${source} is missing; run simgap report again`));
    script.src = source;
    document.head.append(script);
  }));

  addEventListener("load", () => {
    const seen = new IntersectionObserver((entries) => entries.filter((one) => one.isIntersecting).forEach(async ({ target }) => {
      seen.unobserve(target);
      const library = await plotly();
      const [data, layout, config] = waiting.get(target.id);
      library.newPlot(target, data, { ...layout, dragmode: fingers ? false : "zoom" }, config);
    }), { rootMargin: "600px" });
    for (const [name, [, layout]] of waiting) {
      const place = document.getElementById(name);
      place.style.minHeight = `${layout.height}px`; // so that the page does not jump
      seen.observe(place);
    }
  });
})();
