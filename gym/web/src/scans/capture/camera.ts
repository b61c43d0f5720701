/** The phone's rear camera: open it, take a photo, and keep the screen on. */

export type CameraTrouble = "insecure" | "denied" | "missing" | "busy";

/** Some phones never answer `takePhoto`; a frame of the video is taken instead after this time. */
const STILL_MS = 4000;
const JPEG_QUALITY = 0.92;

/** Open the rear camera at its highest resolution, or say why that fails. */
export async function openCamera(): Promise<MediaStream | CameraTrouble> {
  if (!window.isSecureContext) return "insecure";
  if (!("mediaDevices" in navigator)) return "missing";
  const video = { facingMode: { ideal: "environment" }, width: { ideal: 4096 }, height: { ideal: 3072 } };
  try {
    return await navigator.mediaDevices.getUserMedia({ audio: false, video });
  } catch (error) {
    const name = error instanceof Error ? error.name : "";
    if (name === "NotAllowedError" || name === "SecurityError") return "denied";
    return name === "NotFoundError" || name === "OverconstrainedError" ? "missing" : "busy";
  }
}

/** Take a photo by the camera itself if the browser can, else the video's present frame. */
export async function takePhoto(video: HTMLVideoElement, track: MediaStreamTrack): Promise<File> {
  const photo = (await stillOf(track)) ?? (await frameOf(video));
  const at = new Date();
  const name = `camera-${at.toISOString().replace(/\D/g, "")}.${photo.type === "image/png" ? "png" : "jpg"}`;
  return new File([photo], name, { type: photo.type, lastModified: at.getTime() });
}

async function stillOf(track: MediaStreamTrack): Promise<Blob | null> {
  if (!("ImageCapture" in window)) return null;
  const still = new ImageCapture(track).takePhoto().catch(() => null);
  const late = new Promise<null>((resolve) => setTimeout(resolve, STILL_MS, null));
  return Promise.race([still, late]);
}

async function frameOf(video: HTMLVideoElement): Promise<Blob> {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [video.videoWidth, video.videoHeight];
  canvas.getContext("2d")?.drawImage(video, 0, 0);
  const photo = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, "image/jpeg", JPEG_QUALITY));
  if (!photo) throw new Error("the browser could not store the frame");
  return photo;
}

/** Ask for the motion sensors: on an iPhone a tap has to do so. Without them there is no tilt warning. */
export async function askForSensors(): Promise<void> {
  for (const name of ["DeviceOrientationEvent", "DeviceMotionEvent"] as const) {
    const sensor = window[name] as unknown as { requestPermission?: () => Promise<string> } | undefined;
    await sensor?.requestPermission?.().catch(() => "denied");
  }
}

/** Keep the screen on while it is visible. Returns how to stop. */
export function keepScreenOn(): () => void {
  let lock: WakeLockSentinel | null = null;
  let stopped = false;
  const hold = async (): Promise<void> => {
    if (document.visibilityState !== "visible") return;
    // Refused on a low battery: the screen then goes off as usual.
    const got = (await navigator.wakeLock?.request("screen").catch(() => null)) ?? null;
    if (stopped) void got?.release();
    else lock = got;
  };
  void hold();
  document.addEventListener("visibilitychange", hold);
  return () => {
    stopped = true;
    document.removeEventListener("visibilitychange", hold);
    void lock?.release();
  };
}
