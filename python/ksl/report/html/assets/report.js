// Draws the charts of a report with Plotly, each when it comes near the window, and all of them before printing.
"use strict";

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const divs = [...document.querySelectorAll(".chart")];

  const colour = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim(); // of light or dark, as the style sheet has it
  const paper = { width: 334, height: 172 }; // two columns on a page, as in report.css
  const config = { displaylogo: false, responsive: true, modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]], toImageButtonOptions: { format: "svg" } };

  const numbers = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const unit = (label) => label.slice(label.lastIndexOf(", ") + 2);

  // the curves of a chart: over time, or over chart.x, with the time of each point at hand if it has one
  const traces = (chart) => {
    const x = chart.x ? numbers(chart.x.data) : null;
    const time = chart.time ? Float64Array.from(numbers(chart.time), (t) => chart.start + t) : x;
    return chart.panels.flatMap((panel, row) =>
      panel.curves.map((curve, i) => {
        const wide = panel.emphasis && i === 0; // so that others drawn over it leave it visible
        const line = { color: colour(wide ? curve.color + "-wide" : curve.color) || colour("broad"), width: wide ? 6 : 1.3 };
        const plain = { hovertemplate: `%{y:.4g} ${unit(panel.label)} at %{x:.4g} ${chart.x && unit(chart.x.label)}` };
        const over = { customdata: time, hovertemplate: `%{y:.4g} ${unit(panel.label)} at %{x:.4g} ${chart.x && unit(chart.x.label)}, t = %{customdata:.6~r} s<extra></extra>` };
        const along = { hovertemplate: `%{y:.5g} ${unit(panel.label)}` };
        return { type: "scatter", mode: time.length > 1 ? "lines" : "markers", name: curve.name, x: x || time, y: numbers(curve.data), yaxis: row ? "y2" : "y", line, ...(!chart.x ? along : chart.time ? over : plain) };
      })
    );
  };

  // Dashed lines at limits, each with its number: a line that no text explains would be one curve more.
  const limits = (chart) => {
    const line = { color: colour("over"), width: 1.2, dash: "dash" };
    const text = (limit) => `limit ${Number(limit.toPrecision(5))}`;
    const font = { size: printing ? 7 : 10, color: colour("over") };
    const shapes = [];
    const annotations = [];
    for (const x of chart.x ? chart.x.limits : []) {
      shapes.push({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line });
      annotations.push({ x, yref: "paper", y: 1, yanchor: "top", xanchor: x > 0 ? "right" : "left", textangle: -90, text: text(x), font, showarrow: false });
    }
    chart.panels.forEach((panel, row) => {
      const yref = row ? "y2" : "y";
      for (const y of panel.limits) {
        shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, yref, y0: y, y1: y, line });
        annotations.push({ xref: "paper", x: chart.x ? 0.9 : 0.995, xanchor: "right", yref, y, yanchor: y > 0 ? "bottom" : "top", text: text(y), font, showarrow: false });
      }
    });
    return { shapes, annotations };
  };

  const layout = (chart) => {
    const size = printing ? 8 : 12;
    const ink = colour("ink");
    const axis = { gridcolor: colour("grid"), linecolor: colour("rule"), zerolinecolor: colour("zero"), exponentformat: "power", minexponent: 4, automargin: true };
    const titled = (label) => ({ ...axis, title: { text: label, font: { size }, standoff: printing ? 3 : 6 } });
    const stacked = chart.panels.length > 1;
    const named = chart.panels.some((panel) => panel.curves.length > 1);
    const x = { ...titled(chart.x ? chart.x.label : "Time, s"), anchor: stacked ? "y2" : "y" };
    return {
      autosize: !printing,
      ...(printing && paper),
      margin: printing ? { l: 38, r: 6, t: named ? 24 : 8, b: 26 } : { l: 60, r: 12, t: named ? 48 : 28, b: 44 },
      font: { family: "system-ui, sans-serif", size, color: ink },
      paper_bgcolor: colour("page"),
      plot_bgcolor: colour("page"),
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("zero"), activecolor: ink },
      hoverlabel: { bgcolor: colour("pale"), bordercolor: colour("rule"), font: { color: ink } },
      hovermode: chart.x ? "closest" : "x unified",
      hoversubplots: "axis",
      showlegend: named,
      legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)" },
      xaxis: chart.x ? x : { ...x, exponentformat: "none" },
      yaxis: { ...titled(chart.panels[0].label), domain: stacked ? [0.56, 1] : [0, 1] },
      ...(stacked && { yaxis2: { ...titled(chart.panels[1].label), domain: [0, 0.44] } }),
      ...limits(chart),
    };
  };

  // the time charts of a section show the same stretch of time
  const shown = new Map(); // section → [from, to], or null for all of it
  const same = (a, b) => (a && b ? a[0] === b[0] && a[1] === b[1] : a === b);
  const show = (div, range) => Plotly.relayout(div, range ? { "xaxis.range": [...range] } : { "xaxis.autorange": true });

  const follow = (div) => (change) => {
    const range = "xaxis.range[0]" in change ? [change["xaxis.range[0]"], change["xaxis.range[1]"]] : change["xaxis.range"] || null;
    const section = div.closest("section");
    if ((!range && !change["xaxis.autorange"]) || same(range, shown.get(section) || null)) return;
    shown.set(section, range);
    for (const other of drawn) if (other !== div && other.closest("section") === section && !chartOf(other).x) show(other, range);
  };

  const drawn = new Set();
  const chartOf = (div) => data.charts[Number(div.dataset.chart)];
  let printing = false;

  const draw = (div) => {
    if (drawn.has(div)) return;
    drawn.add(div);
    const chart = chartOf(div);
    Plotly.newPlot(div, traces(chart), layout(chart), config);
    if (chart.x) return;
    div.on("plotly_relayout", follow(div));
    const range = shown.get(div.closest("section"));
    if (range) show(div, range);
  };

  // One load case is shown at a time; links to another one choose it.  On paper all are shown.
  const choice = document.getElementById("choice");
  const articles = [...document.querySelectorAll("article.case")];
  const showCase = (number) => {
    articles.forEach((article, i) => (article.hidden = number !== null && i !== number));
    document.querySelectorAll("nav [data-case]").forEach((part) => (part.hidden = Number(part.dataset.case) !== (number ?? 0)));
    if (choice && number !== null) choice.value = number;
    for (const div of drawn) if (!div.closest("[hidden]")) Plotly.Plots.resize(div);
  };
  const followLink = (hash) => {
    const target = document.getElementById(hash.slice(1));
    const article = target?.closest("article.case");
    if (!article?.hidden) return;
    showCase(articles.indexOf(article));
    target.scrollIntoView();
  };

  // draws again what is drawn: in the colours and the size that hold now
  const redraw = (div) => {
    const chart = chartOf(div);
    const range = chart.x ? null : shown.get(div.closest("section"));
    Plotly.react(div, traces(chart), layout(chart), config);
    if (range) show(div, range);
  };

  // Pictures are rendered one after the other: a browser has few WebGL contexts, and each picture gives its own back.
  const stills = [...document.querySelectorAll(".still")];
  const webgl = () => {
    const context = document.createElement("canvas").getContext("webgl");
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return Boolean(context);
  };
  // Plotly.toImage waits half a second for every picture in space.  The scene that it draws gives its image at once.
  const imageOf = async ({ data: shapes, layout }) => {
    const aside = document.createElement("div");
    aside.style.cssText = `position: absolute; left: -10000px; width: ${layout.width}px; height: ${layout.height}px`;
    document.body.append(aside);
    try {
      await Plotly.newPlot(aside, shapes, layout, { staticPlot: true, plotGlPixelRatio: 1.5 });
      const scene = aside._fullLayout.scene?._scene;
      if (scene?.toImage) return scene.toImage("png");
      return await Plotly.toImage(aside, { format: "png", width: layout.width, height: layout.height, scale: 1.5 });
    } finally {
      Plotly.purge(aside);
      aside.remove();
    }
  };
  const renderStill = async (div) => {
    const image = document.createElement("img");
    image.alt = div.getAttribute("aria-label");
    image.src = await imageOf(data.stills[Number(div.dataset.still)]);
    await image.decode();
    div.replaceChildren(image);
  };
  const renderStills = async () => {
    const possible = stills.length > 0 && webgl();
    for (const div of stills) {
      if (possible) await renderStill(div).catch(() => (div.textContent = "The picture could not be drawn by this browser."));
      else div.textContent = "The picture needs WebGL, which this browser does not offer.";
      if (!asked) await new Promise((next) => setTimeout(next, 20)); // the page stays responsive meanwhile
    }
    root.toggleAttribute("data-ready", true);
  };

  const print = (on) => {
    if (printing === on) return;
    printing = on;
    root.toggleAttribute("data-printing", on);
    if (choice) showCase(on ? null : Number(choice.value));
    if (on) document.querySelectorAll("details").forEach((details) => (details.open = true));
    const before = new Set(drawn);
    for (const div of on ? divs : before) before.has(div) ? redraw(div) : draw(div);
  };

  const asked = /^#print=(A4|letter)$/.exec(location.hash);
  asked ? renderStills() : addEventListener("load", () => setTimeout(renderStills, 200));
  addEventListener("beforeprint", () => print(true));
  addEventListener("afterprint", () => asked || print(false));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => printing || drawn.forEach(redraw));

  // report.html#print=A4 is the page as it goes to paper: what --pdf prints.
  if (choice) {
    showCase(0); // the worst
    choice.addEventListener("change", () => showCase(Number(choice.value)));
    addEventListener("hashchange", () => followLink(location.hash));
    addEventListener("click", (event) => followLink(event.target.closest("a")?.hash ?? "")); // also where the address stays the same
    followLink(location.hash);
  }
  if (asked) {
    const style = document.createElement("style");
    style.textContent = `@page { size: ${asked[1]} portrait; }`;
    document.head.append(style);
    print(true);
  } else {
    const watch = new IntersectionObserver((entries) => entries.forEach((entry) => entry.isIntersecting && draw(entry.target)), { rootMargin: "600px" });
    divs.forEach((div) => watch.observe(div));
  }
})();
