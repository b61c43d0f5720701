import { mount } from "svelte";
import App from "./App.svelte";
import "./app.css";
import { begin } from "./i18n.svelte";
import { recall } from "./session.svelte";

await Promise.all([begin(), recall()]);
mount(App, { target: document.getElementById("app")! });

// Below `/embed` the page is somebody else's: nothing is kept there.
if ("serviceWorker" in navigator && window.top === window) void navigator.serviceWorker.register("/sw.js");
