// Says below the live wall what was chosen on it.
document.addEventListener("route-select", ({ detail }) => {
  const route = detail.route;
  document.querySelector("#said").textContent = route
    ? `Route ${route.id}: ${route.holds.length} holds.`
    : "Nothing chosen.";
});
