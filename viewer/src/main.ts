import { WallTopo } from "./element";

if (!customElements.get("wall-topo")) customElements.define("wall-topo", WallTopo);
