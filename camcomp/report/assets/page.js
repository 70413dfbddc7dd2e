"use strict";
(async function () {
  const root = document.documentElement;
  const byId = (id) => document.getElementById(id);
  const specs = JSON.parse(byId("figures").textContent);
  const themeButton = byId("theme");
  const PAPER = { width: 680, height: 300, square: 420 };
  const NARROW = 640; // below it legends stand above, and drawings in space are seen from farther

  function setTheme(name) {
    root.dataset.theme = name;
    themeButton.textContent = name === "dark" ? "Light colours" : "Dark colours";
  }
  setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");

  // The library travels packed, a quarter of its size; the browser unpacks it.
  async function loadLibrary() {
    const packed = byId("library").textContent.trim();
    const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  }

  // Colours stand in the data as var(--name) and are looked up when drawn, so that a theme is only a set of variables.
  function coloured(value, style) {
    if (typeof value === "string" && value.startsWith("var(--"))
      return style.getPropertyValue(value.slice(4, -1)).trim();
    if (Array.isArray(value)) {
      const plain = value.every((v) => v === null || typeof v === "number");
      return plain ? value : value.map((v) => coloured(v, style));
    }
    if (value && typeof value === "object")
      return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, coloured(v, style)]));
    return value;
  }

  function layoutOf(spec, style) {
    const ink = style.getPropertyValue("--ink").trim();
    const grid = style.getPropertyValue("--grid").trim();
    const layout = coloured(spec.layout, style);
    const base = {
      autosize: true, height: spec.height, margin: { l: 70, r: 20, t: 34, b: 50 }, hovermode: "closest",
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, family: getComputedStyle(document.body).fontFamily, size: 13 },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: grid, activecolor: ink },
      legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    };
    const wide = (spec.paper || byId(spec.name + "-plot").clientWidth) >= NARROW;
    if (square(spec) && wide) base.legend = { x: 1.02, y: 1 };
    if (layout.scene) base.legend = { orientation: "h", x: 0, y: 0, yanchor: "top" }; // the tools are above
    const axes = Object.keys(layout).filter((k) => /^[xy]axis\d*$/.test(k));
    const out = { ...base, ...layout };
    for (const key of axes)
      out[key] = { gridcolor: grid, zerolinecolor: grid, linecolor: grid, automargin: true, ...layout[key] };
    if (layout.scene)
      for (const key of ["xaxis", "yaxis", "zaxis"])
        out.scene[key] = { gridcolor: grid, zerolinecolor: grid, color: ink, ...layout.scene[key] };
    if (layout.scene && layout.scene.camera && !wide) {
      const eye = Object.entries(layout.scene.camera.eye).map(([k, v]) => [k, FARTHER * v]);
      out.scene.camera = { ...layout.scene.camera, eye: Object.fromEntries(eye) };
    }
    return out;
  }

  const FARTHER = 1.7;
  const square = (spec) => Boolean(spec.layout.yaxis && spec.layout.yaxis.scaleanchor);

  const CONFIG = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["sendDataToCloud", "lasso2d", "select2d"] };

  function draw(spec) {
    const style = getComputedStyle(root);
    const made = spec.exaggerate ? exaggerated(spec) : spec;
    return Plotly.react(byId(spec.name + "-plot"), coloured(made.traces, style), layoutOf(made, style), CONFIG);
  }

  // The slider is logarithmic: 0..100 stands for the factors 1..most.
  const factorOf = (spec) => Math.pow(spec.exaggerate.most, Number(byId(spec.name + "-k").value) / 100);
  const moved = (b, shift, k) => (b === null || shift === null ? null : b + k * shift);
  const shown = (k) => (k < 9.95 ? k.toFixed(1) : String(Math.round(k))) + " times";

  function exaggerated(spec) {
    const { base, shifts } = spec.exaggerate;
    const k = factorOf(spec);
    if (Array.isArray(base)) { // in space: every curve has its own points
      const at = (i, axis) => base[i][axis].map((b, j) => moved(b, shifts[i][axis][j], k));
      return { ...spec, traces: spec.traces.map((trace, i) => ({ ...trace, x: at(i, "x"), y: at(i, "y"), z: at(i, "z") })) };
    }
    const [h, v] = byId(spec.name + "-p").value.toLowerCase();
    const along = (i, axis) => {
      const shift = shifts[i] && shifts[i][axis];
      return shift ? base[axis].map((b, j) => moved(b, shift[j], k)) : base[axis];
    };
    const traces = spec.traces.map((trace, i) => ({ ...trace, x: along(i, h), y: along(i, v) }));
    const layout = { ...spec.layout };
    layout.xaxis = { ...layout.xaxis, title: { text: h + " in mm" } };
    layout.yaxis = { ...layout.yaxis, title: { text: v + " in mm" } };
    return { ...spec, traces, layout };
  }

  function wireSlider(spec) {
    const slider = byId(spec.name + "-k"), plane = byId(spec.name + "-p"), out = byId(spec.name + "-o");
    slider.value = Math.round((100 * Math.log(spec.exaggerate.first)) / Math.log(spec.exaggerate.most));
    const tell = () => {
      out.textContent = shown(factorOf(spec));
      slider.setAttribute("aria-valuetext", out.textContent);
    };
    const change = () => { tell(); draw(spec); };
    slider.addEventListener("input", change);
    if (plane) plane.addEventListener("change", change);
    tell();
  }

  function wireTable(table) {
    const heads = [...table.tHead.rows[0].cells], body = table.tBodies[0];
    heads.forEach((head, column) => head.firstChild.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") !== "descending";
      heads.forEach((each) => each.setAttribute("aria-sort", "none"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const value = (row) => Number(row.cells[column].dataset.v ?? NaN);
      const text = (row) => row.cells[column].textContent;
      const order = (a, b) => (isNaN(value(a)) ? text(a).localeCompare(text(b)) : value(a) - value(b));
      body.append(...[...body.rows].sort((a, b) => (down ? order(b, a) : order(a, b))));
    }));
  }
  document.querySelectorAll("table.sortable").forEach(wireTable);

  async function drawAll() {
    for (const spec of specs) await draw(spec);
  }
  themeButton.addEventListener("click", async () => {
    setTheme(root.dataset.theme === "dark" ? "light" : "dark");
    if (specs.length) await drawAll();
  });

  if (specs.length) {
    await loadLibrary();
    for (const spec of specs) {
      if (spec.exaggerate) wireSlider(spec);
      await draw(spec);
      byId(spec.name + "-plot").dataset.drawn = "yes";
    }
    // Paper is white and narrower than a screen.
    let theme;
    addEventListener("beforeprint", () => {
      theme = root.dataset.theme;
      const paper = getComputedStyle(root).getPropertyValue("--paper");
      setTheme("light");
      for (const spec of specs) {
        const plot = byId(spec.name + "-plot");
        if (spec.layout.scene) { // its canvas follows too late for paper: it becomes smaller as it is, on its own ground
          const width = plot.clientWidth;
          plot.style.background = paper;
          plot.style.width = width + "px";
          plot.style.zoom = Math.min(PAPER.width / width, 1);
          continue;
        }
        const height = square(spec) ? PAPER.square : Math.min(spec.height, PAPER.height);
        draw({ ...spec, paper: PAPER.width, height });
        Plotly.relayout(plot, { width: PAPER.width, height, autosize: false });
        plot.style.height = height + "px";
      }
    });
    addEventListener("afterprint", () => {
      setTheme(theme);
      for (const spec of specs) {
        const plot = byId(spec.name + "-plot");
        plot.style.height = spec.height + "px";
        plot.style.width = plot.style.zoom = plot.style.background = "";
      }
      drawAll();
    });
  }
  document.body.dataset.ready = "yes";
})();
