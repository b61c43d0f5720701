import { defineConfig } from "vitest/config";

export default defineConfig({ test: { include: ["tests/{capture,competitions,outbox,publishing,scans,shell}/*.test.mjs"], testTimeout: 120_000 } });
