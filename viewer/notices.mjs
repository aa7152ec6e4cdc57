// Writes the licences of the packages whose code is in the page: notices.mjs LOCK_FILE NODE_MODULES OUT.
// Packages needed only to build or test ("dev" in the lock file) are not in the page.
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const [lockFile, modules, out] = process.argv.slice(2);
const packages = Object.entries(JSON.parse(readFileSync(lockFile, "utf8")).packages)
  .filter(([path, entry]) => path.startsWith("node_modules/") && !entry.dev && !entry.devOptional && !entry.optional)
  .map(([path, entry]) => ({ name: path.replace(/^.*node_modules\//, ""), folder: join(modules, "..", path), ...entry }))
  .sort((a, b) => a.name.localeCompare(b.name));

const parts = packages.map(({ name, version, license, folder }) => {
  const texts = readdirSync(folder).filter((file) => /^(licen[cs]e|notice|copying)/i.test(file)).sort()
    .map((file) => readFileSync(join(folder, file), "utf8").trim());
  const { author } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const words = texts.length > 0 ? texts.join("\n\n") : `${license ?? "no licence stated"}${author ? `; author: ${author.name ?? author}` : ""}`;
  return `${name} ${version} (${license ?? "licence as below"})\n\n${words}\n`;
});
writeFileSync(out, "Waymark's page contains code of these packages.\n\n" + parts.join(`\n${"-".repeat(80)}\n\n`));
