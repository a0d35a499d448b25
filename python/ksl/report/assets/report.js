// Draws the charts of a report with Plotly, each when it comes near the window, all before printing.
"use strict";

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const divs = [...document.querySelectorAll(".chart")];

  const colours = ["#0b5cad", "#d0650b", "#2f7d4f", "#1b2027"];
  const broad = "#c3cad4"; // for a curve that others lie upon
  const ink = "#1b2027";
  const rule = "#d5d9df";
  const dashed = { color: "#a11212", width: 1.2, dash: "dash" };
  const printed = { width: 470, height: 265 }; // two columns on a landscape page
  const config = { displaylogo: false, responsive: true, modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]], toImageButtonOptions: { format: "svg" } };

  const numbers = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const unit = (label) => label.slice(label.lastIndexOf(", ") + 2);

  // the curves of a chart: over time, or over chart.x with the time of each point at hand
  const traces = (chart) => {
    const time = Float64Array.from(numbers(chart.time), (t) => data.start + t);
    const x = chart.x ? numbers(chart.x.data) : time;
    const before = (row) => chart.panels.slice(0, row).reduce((n, panel) => n + panel.curves.length, 0); // curves above: one colour each
    return chart.panels.flatMap((panel, row) =>
      panel.curves.map((curve, i) => {
        const line = panel.emphasis && i === 0 ? { color: broad, width: 6 } : { color: colours[panel.emphasis ? i - 1 : i + before(row)], width: 1.3 };
        const over = { customdata: time, hovertemplate: `%{y:.4g} ${unit(panel.label)} at %{x:.4g} ${chart.x && unit(chart.x.label)}, t = %{customdata:.6~r} s<extra></extra>` };
        const along = { hovertemplate: `%{y:.5g} ${unit(panel.label)}` };
        return { type: "scatter", mode: time.length > 1 ? "lines" : "markers", name: curve.name, x, y: numbers(curve.data), yaxis: row ? "y2" : "y", line, ...(chart.x ? over : along) };
      })
    );
  };

  // dashed lines at the limits on both sides of zero: a rectangle where both coordinates have one
  const limits = (chart) => {
    const u = chart.x ? chart.x.limit : null;
    if (u && chart.panels[0].limit) {
      const v = chart.panels[0].limit;
      return [{ type: "rect", x0: -u, x1: u, y0: -v, y1: v, line: dashed }];
    }
    const upright = u ? [-u, u].map((x) => ({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line: dashed })) : [];
    const level = chart.panels.flatMap((panel, row) =>
      panel.limit ? [-panel.limit, panel.limit].map((y) => ({ type: "line", xref: "paper", x0: 0, x1: 1, yref: row ? "y2" : "y", y0: y, y1: y, line: dashed })) : []
    );
    return [...upright, ...level];
  };

  const layout = (chart) => {
    const axis = { gridcolor: "#e8eaee", linecolor: rule, zerolinecolor: "#9aa3ae", exponentformat: "power", minexponent: 4, automargin: true };
    const titled = (label) => ({ ...axis, title: { text: label, font: { size: 12 }, standoff: 6 } });
    const stacked = chart.panels.length > 1;
    const named = chart.panels.some((panel) => panel.curves.length > 1);
    const x = { ...titled(chart.x ? chart.x.label : "Time, s"), anchor: stacked ? "y2" : "y" };
    return {
      autosize: true,
      margin: { l: 60, r: 12, t: named ? 48 : 28, b: 44 },
      font: { family: "system-ui, sans-serif", size: 12, color: ink },
      paper_bgcolor: "#fff",
      plot_bgcolor: "#fff",
      hovermode: chart.x ? "closest" : "x unified",
      hoversubplots: "axis",
      showlegend: named,
      legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
      xaxis: chart.x ? x : { ...x, exponentformat: "none" },
      yaxis: { ...titled(chart.panels[0].label), domain: stacked ? [0.56, 1] : [0, 1] },
      ...(stacked && { yaxis2: { ...titled(chart.panels[1].label), domain: [0, 0.44] } }),
      shapes: limits(chart),
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

  const draw = (div, size) => {
    if (drawn.has(div)) return;
    drawn.add(div);
    const chart = chartOf(div);
    Plotly.newPlot(div, traces(chart), { ...layout(chart), ...size }, config);
    if (chart.x) return;
    div.on("plotly_relayout", follow(div));
    const range = shown.get(div.closest("section"));
    if (range) show(div, range);
  };

  const watch = new IntersectionObserver((entries) => entries.forEach((entry) => entry.isIntersecting && draw(entry.target)), { rootMargin: "600px" });
  divs.forEach((div) => watch.observe(div));

  addEventListener("beforeprint", () => {
    document.querySelectorAll("details").forEach((details) => (details.open = true));
    for (const div of divs) drawn.has(div) ? Plotly.relayout(div, printed) : draw(div, printed);
  });
  addEventListener("afterprint", () => divs.forEach((div) => Plotly.relayout(div, { autosize: true })));
})();
