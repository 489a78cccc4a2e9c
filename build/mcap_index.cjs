// Read a recording as Foxglove does: by its index, with the reader that Foxglove publishes.
//
//   npm install --prefix FOLDER @mcap/core @mcap/nodejs fzstd
//   node build/mcap_index.cjs FOLDER RECORDING.mcap
//
// Prints the topics with encoding, schema and number of messages, and the first message of each.
// Every message is read in order of time, every checksum is checked, every JSON is parsed.

const { createRequire } = require("node:module");
const { open } = require("node:fs/promises");
const path = require("node:path");

async function main(folder, file) {
  const load = createRequire(path.join(path.resolve(folder), "x.js"));
  const { McapIndexedReader } = load("@mcap/core");
  const { FileHandleReadable } = load("@mcap/nodejs");
  const { decompress } = load("fzstd");
  const handle = await open(file, "r");
  const reader = await McapIndexedReader.Initialize({
    readable: new FileHandleReadable(handle),
    decompressHandlers: { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) },
  });
  const topics = {};
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId)?.name ?? "";
    topics[channel.topic] = { encoding: channel.messageEncoding, schema, messages: 0 };
  }
  let last = 0n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    const topic = topics[channel.topic];
    if (message.logTime < last) throw new Error(`${channel.topic}: out of order`);
    last = message.logTime;
    topic.messages += 1;
    if (channel.messageEncoding === "json") {
      const content = JSON.parse(new TextDecoder().decode(message.data));
      topic.first ??= content;
    }
  }
  await handle.close();
  const chunks = reader.chunkIndexes.length;
  console.log(JSON.stringify({ topics, chunks, messages: Number(reader.statistics.messageCount) }));
}

main(...process.argv.slice(2));
