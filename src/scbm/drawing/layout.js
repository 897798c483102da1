// Runs in QuickJS after dagre: `layOut` takes and returns JSON. QuickJS has no `structuredClone`.
globalThis.structuredClone = value => JSON.parse(JSON.stringify(value));
function layOut(text) {
  const {nodes, edges} = JSON.parse(text);
  const graph = new dagre.graphlib.Graph({multigraph: true});
  graph.setGraph({rankdir: "LR", nodesep: 16, edgesep: 12, ranksep: 28, marginx: 2, marginy: 2});
  nodes.forEach(([width, height], index) => graph.setNode(String(index), {width, height}));
  edges.forEach(([source, target, width, height], index) =>
    graph.setEdge(String(source), String(target), {width, height, labelpos: "c"}, String(index)));
  dagre.layout(graph);
  const {width, height} = graph.graph();
  const centers = nodes.map((_, index) => { const {x, y} = graph.node(String(index)); return [x, y]; });
  const routes = edges.map(([source, target], index) => {
    const {points, x, y} = graph.edge(String(source), String(target), String(index));
    return [points.map(point => [point.x, point.y]), [x, y]];
  });
  return JSON.stringify([[width, height], centers, routes]);
}
