#include "service/jobs/tokens.h"

#include <gtest/gtest.h>

#include <thread>

#include "service/storage/digest.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

class TokensTest : public testing::Test {
 protected:
  static Token token(const std::string& name, std::vector<Scope> scopes = {Scope::kRead}) {
    Token token;
    token.name = name;
    token.scopes = std::move(scopes);
    return token;
  }
  std::string slug_with(const std::string& text) {
    const auto caller = tokens_.caller_with(text);
    return caller ? "none" : caller.error().slug;
  }

  ScratchFolder scratch_;
  StoreDatabase database_{scratch_.path() / "test.db"};
  Tokens tokens_{database_};
};

TEST_F(TokensTest, WithoutAnyEveryoneMayDoEverything) {
  EXPECT_FALSE(tokens_.needed());
  for (const char* sent : {"", "volsmooth_x_y"}) {
    const Caller caller = tokens_.caller_with(sent).value();
    EXPECT_EQ(caller.tenant, kDefaultTenant);
    EXPECT_TRUE(caller.may(Scope::kAdmin) && caller.may(Scope::kRead));
    EXPECT_TRUE(tokens_.is_current(caller));
  }
  const Caller before = Caller::anyone();
  tokens_.require();
  EXPECT_TRUE(tokens_.needed());
  EXPECT_EQ(slug_with(""), "unauthenticated");
  EXPECT_FALSE(tokens_.is_current(before));
}

TEST_F(TokensTest, SaysWhoItsHolderIs) {
  Token wanted = token("ct_room-2", {Scope::kRead, Scope::kSubmit});
  wanted.tenant = "ward-a";
  const std::string text = tokens_.create(wanted).value();
  {
    const Caller caller = tokens_.caller_with(text).value();
    EXPECT_EQ(caller.tenant, "ward-a");
    EXPECT_EQ(caller.token, "ct_room-2");
    EXPECT_TRUE(caller.may(Scope::kRead) && caller.may(Scope::kSubmit));
    EXPECT_FALSE(caller.may(Scope::kAdmin));
  }
  const Tokens after_a_restart(database_);
  EXPECT_EQ(after_a_restart.caller_with(text)->tenant, "ward-a");
  EXPECT_FALSE(after_a_restart.caller_with(text)->may(Scope::kAdmin));
}

TEST_F(TokensTest, OnlyTheWholeTokenWillDo) {
  const std::string text = tokens_.create(token("one")).value();
  const std::string other = tokens_.create(token("two")).value();
  const std::string secret = text.substr(text.rfind('_') + 1);
  for (std::string wrong :
       {std::string(), secret, text.substr(0, text.size() - 1), text + "a", "volsmooth_two_" + secret,
        "volsmooth__" + secret, "volsmooth_" + secret, std::string("volsmooth_one_"), " " + text,
        "volsmooth_one_" + Sha256().hex(), std::string(8000, '_'), std::string("volsmooth_\0", 11)})
    EXPECT_EQ(slug_with(wrong), "unauthenticated") << wrong;
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string changed = text;
    changed[at] = changed[at] == 'a' ? 'b' : 'a';
    if (changed == text) continue;
    EXPECT_EQ(slug_with(changed), "unauthenticated") << changed;
  }
  EXPECT_EQ(slug_with(text), "none");
  EXPECT_EQ(slug_with(other), "none");
}

TEST_F(TokensTest, SecretsAreNowhereButWithTheirHolders) {
  const std::string text = tokens_.create(token("one")).value();
  const std::string secret = text.substr(text.rfind('_') + 1);
  EXPECT_GE(secret.size() * 5, 256U);  // base 32
  for (const auto& entry : std::filesystem::directory_iterator(scratch_.path())) {
    std::ifstream in(entry.path(), std::ios::binary);
    const std::string content((std::istreambuf_iterator<char>(in)), {});
    EXPECT_EQ(content.find(secret), std::string::npos) << entry.path();
  }
  EXPECT_NE(secret, tokens_.create(token("two")).value().substr(text.rfind('_') + 1));
}

TEST_F(TokensTest, ARevokedOneIsGoneAtOnceAndForEver) {
  const std::string text = tokens_.create(token("one")).value();
  const Caller caller = tokens_.caller_with(text).value();
  EXPECT_TRUE(tokens_.revoke("one"));
  EXPECT_TRUE(tokens_.revoke("one"));
  EXPECT_EQ(slug_with(text), "unauthenticated");
  EXPECT_FALSE(tokens_.is_current(caller));
  EXPECT_EQ(tokens_.create(token("one")).error().members.at("member"), "name");
  EXPECT_EQ(tokens_.revoke("two").error().slug, "not-found");
  const Tokens after_a_restart(database_);
  EXPECT_FALSE(after_a_restart.caller_with(text));
  EXPECT_TRUE(after_a_restart.needed()) << "the door must not open when the last key is taken away";
  EXPECT_TRUE(after_a_restart.all()[0].revoked_at);
}

TEST_F(TokensTest, AllCanBeRevokedTogether) {
  std::vector<std::string> texts;
  for (const char* name : {"one", "two", "three"}) texts.push_back(tokens_.create(token(name)).value());
  ASSERT_TRUE(tokens_.revoke("two"));
  EXPECT_EQ(tokens_.revoke_all(), 2);
  EXPECT_EQ(tokens_.revoke_all(), 0);
  for (const std::string& text : texts) EXPECT_EQ(slug_with(text), "unauthenticated");
  const Tokens after_a_restart(database_);
  for (const std::string& text : texts) EXPECT_FALSE(after_a_restart.caller_with(text));
  EXPECT_EQ(database_.read([](Database& database) {
    return all_of(database.query("SELECT subject FROM audit WHERE action = 'token revoked' ORDER BY subject"),
                  [](const Statement& row) { return row.text(0); });
  }),
            (std::vector<std::string>{"one", "three", "two"}));
}

TEST_F(TokensTest, HoldsUntilItExpires) {
  Token wanted = token("one");
  wanted.expires_at = now_in_milliseconds() + 200ms;
  const std::string text = tokens_.create(wanted).value();
  const Caller caller = tokens_.caller_with(text).value();
  std::this_thread::sleep_until(*wanted.expires_at);
  EXPECT_EQ(slug_with(text), "unauthenticated");
  EXPECT_FALSE(tokens_.is_current(caller));
  wanted.name = "two";
  EXPECT_EQ(tokens_.create(wanted).error().members.at("member"), "expires");
}

TEST_F(TokensTest, RefusesWhatCannotBe) {
  for (const std::string& name :
       {std::string(), std::string("a b"), std::string(65, 'a'), std::string("a\n")})
    EXPECT_EQ(tokens_.create(token(name)).error().members.at("member"), "name");
  Token wanted = token("one");
  wanted.tenant = "";
  EXPECT_EQ(tokens_.create(wanted).error().members.at("member"), "tenant");
  EXPECT_EQ(tokens_.create(token("one", {})).error().members.at("member"), "scope");
  EXPECT_FALSE(tokens_.needed());
}

TEST_F(TokensTest, TellsOfEveryChange) {
  int told = 0;
  tokens_.on_change([&] { ++told; });
  ASSERT_TRUE(tokens_.create(token("one")));
  EXPECT_EQ(told, 1);
  ASSERT_TRUE(tokens_.revoke("one"));
  EXPECT_EQ(told, 2);
  tokens_.on_change({});
  ASSERT_TRUE(tokens_.create(token("two")));
  EXPECT_EQ(told, 2);
}

TEST_F(TokensTest, EveryChangeIsAudited) {
  ASSERT_TRUE(tokens_.create(token("one")));
  ASSERT_TRUE(tokens_.revoke("one"));
  const auto actions = database_.read([](Database& database) {
    return all_of(database.query("SELECT action FROM audit WHERE subject = 'one' ORDER BY sequence"),
                  [](const Statement& row) { return row.text(0); });
  });
  EXPECT_EQ(actions, (std::vector<std::string>{"token created", "token revoked"}));
}

}  // namespace
}  // namespace volsmooth
