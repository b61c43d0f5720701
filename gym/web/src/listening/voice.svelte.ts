/** Sentences spoken by the browser's own voice, and by the keys of headphones and of a locked screen. */

import { locale } from "../i18n.svelte";

const KEPT = "walltopo-voice";

interface VoiceSettings {
  /** Whether sentences are spoken; else a friend reads them aloud. */
  on: boolean;
  /** Words against the usual speed. */
  rate: number;
}

export const RATES = [0.7, 0.85, 1, 1.2, 1.5] as const;

export const settings = $state<VoiceSettings>({ on: true, rate: 1, ...(JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Partial<VoiceSettings>) });

export function keepSettings(): void {
  localStorage.setItem(KEPT, JSON.stringify(settings));
}

export function canSpeak(): boolean {
  return "speechSynthesis" in window;
}

/** The best voice of a language: of this device, so that it speaks without reception, and of one's own country. */
function voiceFor(language: string): SpeechSynthesisVoice | null {
  const own = locale();
  const voices = speechSynthesis.getVoices().filter(({ lang }) => lang.replace("_", "-").startsWith(language));
  const rank = (voice: SpeechSynthesisVoice): number => Number(voice.localService) * 2 + Number(voice.lang === own);
  return voices.toSorted((a, b) => rank(b) - rank(a))[0] ?? null;
}

/** Say a text; what is being said stops. */
export function say(text: string, language: string): void {
  if (!settings.on || !canSpeak()) return;
  speechSynthesis.cancel();
  const spoken = new SpeechSynthesisUtterance(text);
  spoken.lang = language;
  spoken.voice = voiceFor(language);
  spoken.rate = settings.rate;
  speechSynthesis.speak(spoken);
}

export function hush(): void {
  if (canSpeak()) speechSynthesis.cancel();
}

/** One second without a sound: keys of headphones reach a page only while it plays something. */
function silence(): Blob {
  const samples = 8000;
  const view = new DataView(new ArrayBuffer(44 + samples));
  const text = (at: number, letters: string) => [...letters].forEach((letter, k) => view.setUint8(at + k, letter.charCodeAt(0)));
  text(0, "RIFF");
  view.setUint32(4, 36 + samples, true);
  text(8, "WAVEfmt ");
  view.setUint32(16, 16, true);
  view.setUint16(20, 1, true); // PCM
  view.setUint16(22, 1, true); // one channel
  view.setUint32(24, samples, true);
  view.setUint32(28, samples, true);
  view.setUint16(32, 1, true);
  view.setUint16(34, 8, true);
  text(36, "data");
  view.setUint32(40, samples, true);
  for (let k = 0; k < samples; k++) view.setUint8(44 + k, 128);
  return new Blob([view], { type: "audio/wav" });
}

export interface Keys {
  next: () => void;
  back: () => void;
  again: () => void;
}

/** Lets the keys of headphones and of a locked screen turn the steps, where the platform allows it; call it in a tap. */
export class MediaKeys {
  private audio: HTMLAudioElement | null = null;

  begin(title: string, keys: Keys): void {
    if (!("mediaSession" in navigator) || this.audio) return;
    this.audio = new Audio(URL.createObjectURL(silence()));
    this.audio.loop = true;
    void this.audio.play().catch(() => undefined); // the page works without
    navigator.mediaSession.metadata = new MediaMetadata({ title });
    navigator.mediaSession.setActionHandler("nexttrack", keys.next);
    navigator.mediaSession.setActionHandler("previoustrack", keys.back);
    for (const key of ["play", "pause"] as const) {
      navigator.mediaSession.setActionHandler(key, () => {
        void this.audio?.play().catch(() => undefined);
        keys.again();
      });
    }
  }

  end(): void {
    if (!this.audio) return;
    this.audio.pause();
    URL.revokeObjectURL(this.audio.src);
    this.audio = null;
    for (const key of ["nexttrack", "previoustrack", "play", "pause"] as const) navigator.mediaSession.setActionHandler(key, null);
  }
}
