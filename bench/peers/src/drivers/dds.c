/* CycloneDDS as a driver sees it: a participant, writers and readers of frames. Numbers below 0 are its error codes. */

#include "frames.h"
#include "dds/dds.h"
#include <string.h>

/* Nothing is dropped, and nobody gets what was before. */
static dds_qos_t *qos(void)
{
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  return qos;
}

int32_t peers_dds_participant(uint32_t domain, const char *configuration)
{
  dds_entity_t created = dds_create_domain(domain, configuration);
  return created < 0 ? created : dds_create_participant(domain, NULL, NULL);
}

int32_t peers_dds_writer(int32_t participant, const char *name)
{
  dds_entity_t topic = dds_create_topic(participant, &peers_Frame_desc, name, NULL, NULL);
  if (topic < 0) return topic;
  dds_qos_t *q = qos();
  dds_entity_t writer = dds_create_writer(participant, topic, q, NULL);
  dds_delete_qos(q);
  return writer;
}

int32_t peers_dds_reader(int32_t participant, const char *name)
{
  dds_entity_t topic = dds_create_topic(participant, &peers_Frame_desc, name, NULL, NULL);
  if (topic < 0) return topic;
  dds_qos_t *q = qos();
  dds_entity_t reader = dds_create_reader(participant, topic, q, NULL);
  dds_delete_qos(q);
  return reader;
}

/* What a process sleeps on until the reader has something. */
int32_t peers_dds_waitset(int32_t participant, int32_t reader)
{
  dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
  if (condition < 0) return condition;
  dds_entity_t waitset = dds_create_waitset(participant);
  if (waitset < 0) return waitset;
  dds_return_t attached = dds_waitset_attach(waitset, condition, 0);
  return attached < 0 ? attached : waitset;
}

int32_t peers_dds_wait(int32_t waitset)
{
  return dds_waitset_wait(waitset, NULL, 0, DDS_INFINITY);
}

/* Matched readers. */
int32_t peers_dds_matched(int32_t writer)
{
  dds_publication_matched_status_t status;
  dds_return_t got = dds_get_publication_matched_status(writer, &status);
  return got < 0 ? got : (int32_t)status.current_count;
}

int32_t peers_dds_write(int32_t writer, const uint8_t *bytes, uint32_t length)
{
  peers_Frame frame;
  frame.bytes._buffer = (uint8_t *)bytes;
  frame.bytes._length = length;
  frame.bytes._maximum = length;
  frame.bytes._release = false;
  return dds_write(writer, &frame);
}

/* Takes one frame of this length: 1, or 0 if there is none. */
int32_t peers_dds_take(int32_t reader, uint8_t *bytes, uint32_t length)
{
  void *samples[1] = { NULL };
  dds_sample_info_t info[1];
  dds_return_t count = dds_take(reader, samples, info, 1, 1);
  if (count <= 0) return count;
  const peers_Frame *frame = samples[0];
  int32_t result = 0;
  if (info[0].valid_data) {
    result = frame->bytes._length == length ? 1 : DDS_RETCODE_BAD_PARAMETER;
    if (result == 1) memcpy(bytes, frame->bytes._buffer, length);
  }
  dds_return_t returned = dds_return_loan(reader, samples, count);
  return returned < 0 ? returned : result;
}

const char *peers_dds_error(int32_t code)
{
  return dds_strretcode(code);
}
