// What the tables of a store are kept in: SQL with statuses.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo {

// One run of a statement, as its database makes it.
class Statement {
 public:
  virtual ~Statement() = default;
  // Parameters $1, $2, ... in order, from 1 on.
  virtual absl::Status Bind(int number, int64_t value) = 0;
  virtual absl::Status Bind(int number, const std::string& value) = 0;
  virtual absl::StatusOr<bool> Step() = 0;
  // To its end; `behind`: as Query::Post().
  virtual absl::Status Run(bool behind) = 0;
  virtual int64_t Integer(int column) const = 0;
  virtual std::string Bytes(int column) const = 0;
};

// One run of a statement: parameters in, rows out. Lives shorter than its database.
class Query {
 public:
  explicit Query(std::unique_ptr<Statement> statement) : statement_(std::move(statement)) {}

  Query& Bind(int64_t value) { return Bound(statement_->Bind(++bound_, value)); }
  Query& Bind(const std::string& value) {  // text or bytes
    return Bound(statement_->Bind(++bound_, value));
  }

  // Whether there is a(nother) row. RESOURCE_EXHAUSTED when the disk is full or memory is short,
  // be it for a value that was bound, UNAVAILABLE when the database is held by another program or
  // cannot be reached, ALREADY_EXISTS when a value must be unique, DATA_LOSS when what is stored is
  // damaged, else INTERNAL.
  absl::StatusOr<bool> Step() {
    if (!binding_.ok()) return binding_;
    return statement_->Step();
  }

  // To its end; rows are dropped.
  absl::Status Run() { return binding_.ok() ? statement_->Run(/*behind=*/false) : binding_; }

  // The same within a transaction, without waiting for an answer where the database is far away.
  // What goes wrong is told by a later statement or by the end of the transaction.
  absl::Status Post() { return binding_.ok() ? statement_->Run(/*behind=*/true) : binding_; }

  // Of the row, columns from 0.
  int64_t Integer(int column) const { return statement_->Integer(column); }
  std::string Bytes(int column) const { return statement_->Bytes(column); }

 private:
  // A value that is not bound is NULL, and would be stored so.
  Query& Bound(absl::Status status) {
    if (binding_.ok()) binding_ = std::move(status);
    return *this;
  }

  std::unique_ptr<Statement> statement_;
  int bound_ = 0;
  absl::Status binding_;  // of the first value that could not be bound
};

// Used by one thread at a time. What a transaction changed is on disk when it returns. Statements
// are such as both SQLite and PostgreSQL read, unless they are of one of them alone.
class Database {
 public:
  virtual ~Database() = default;

  virtual absl::StatusOr<Query> Prepare(const std::string& sql) = 0;

  // Several statements without parameters.
  virtual absl::Status Execute(const std::string& sql) = 0;

  // The first column of the first row, 0 when there is none.
  absl::StatusOr<int64_t> Number(const std::string& sql);

  // `body` as one transaction: all of it is on disk when this returns OK, else nothing of it.
  // Nobody else is within such a body of the same database meanwhile, also in another process.
  virtual absl::Status Transact(const std::function<absl::Status()>& body) = 0;

  // The same beside others: for rows that are locked one by one.
  virtual absl::Status TransactBesideOthers(const std::function<absl::Status()>& body) {
    return Transact(body);
  }

  // The same without waiting for the disk: it is there before anything of a later transaction is.
  virtual absl::Status TransactUnflushed(const std::function<absl::Status()>& body) {
    return TransactBesideOthers(body);
  }

  // Whether other processes work with it at the same time.
  virtual bool shared() const { return false; }

  // Gives room that holds nothing back to the disk.
  virtual absl::Status Shrink() = 0;

  // Rows that the latest statement that was run to its end changed.
  virtual int Changes() const = 0;
};

}  // namespace rilievo
