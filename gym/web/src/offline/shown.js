// Messages that somebody chose to get (hall/push.py): shown, and on a tap the page they are about.

self.addEventListener("push", (event) => {
  const { title, text, path, tag } = event.data.json();
  // One of a tag: what is sent once more replaces itself.
  event.waitUntil(self.registration.showNotification(title, { body: text, tag, data: { path }, icon: "/icon-192.png", badge: "/icon-192.png" }));
});

self.addEventListener("notificationclick", (event) => {
  event.notification.close();
  event.waitUntil(open(new URL(event.notification.data.path, location.origin)));
});

async function open(address) {
  if (address.origin !== location.origin) return;
  const pages = await self.clients.matchAll({ type: "window", includeUncontrolled: true });
  const page = pages.find(({ url }) => !new URL(url).pathname.startsWith("/kiosk/"));
  if (!page) return void (await self.clients.openWindow(address));
  await page.focus();
  await page.navigate(address);
}
