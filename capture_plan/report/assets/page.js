/* The plan page: connects the tables and cards to the 3D head, filters markers, saves the plan's data. */
"use strict";
(async function () {
  const read = (id) => document.getElementById(id).textContent;
  const data = JSON.parse(read("head-data"));
  const root = document.getElementById("viewer");

  const search = document.getElementById("marker-search");
  const rows = [...document.querySelectorAll("[data-marker]")];
  search.addEventListener("input", () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
      shown += !row.hidden;
    }
    document.getElementById("marker-count").textContent = `${shown} of ${rows.length} markers`;
  });

  // The data were written with <, > and & as \u003c ...; putting those back gives plan.json byte for byte.
  document.getElementById("save").addEventListener("click", () => {
    const plain = { u003c: "<", u003e: ">", u0026: "&", u0027: "'", u2028: "\u2028", u2029: "\u2029" };
    const text = read("plan-data").replace(/\\(\\|u003c|u003e|u0026|u0027|u2028|u2029)/g, (all, code) => plain[code] || all);
    const link = CapturePlan.element("a", { download: "plan.json", href: URL.createObjectURL(new Blob([text], { type: "application/json" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
  document.getElementById("print").addEventListener("click", () => print());

  CapturePlan.showChecks(document.getElementById("checks"), document.getElementById("checked"), JSON.parse(read("plan-data")), JSON.parse(read("evidence-data")));

  const app = await CapturePlan.start(root, data);
  document.documentElement.classList.add(app ? "has-3d" : "no-3d");
  if (!app) return;
  const { viewer, panel } = app;

  const choose = (m) => {
    viewer.onSelect(m);
    if (viewer.selected === m) viewer.lookAt(m);
    root.scrollIntoView({ behavior: viewer.calm ? "auto" : "smooth", block: "center" });
  };
  for (const row of rows) row.addEventListener("click", () => choose(Number(row.dataset.marker)));
  root.addEventListener("marker", ({ detail }) => {
    for (const row of rows) row.classList.toggle("chosen", Number(row.dataset.marker) === detail.marker);
  });
  for (const button of document.querySelectorAll("[data-expression]")) {
    button.addEventListener("click", () => {
      panel.stop();
      panel.show(Number(button.dataset.expression));
      root.scrollIntoView({ behavior: viewer.calm ? "auto" : "smooth", block: "center" });
    });
  }
})();
